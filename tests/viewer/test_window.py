"""The scene in the browser: what the panel says, where nodes are and in which colours, what the controls do."""

import socket
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.viewer import window as panel
from thermal_robot.viewer.settings import ASIDE, GAP, LONGEST_ARROW, NO_SHARE, colours, linear
from thermal_robot.viewer.window import BACK, ON, WORST, Cloud, Puppet, Window, solids


class Nodes:
    """A scene that is not served; a node without its parent is refused, as the browser would not place it."""

    def __init__(self):
        self.added = {}

    def _keep(self, name, **given):
        assert name not in self.added, f"{name} is made anew"
        parent = name.rsplit("/", 1)[0]
        assert parent.count("/") == 1 or parent in self.added, f"{name} has no parent"
        self.added[name] = SimpleNamespace(position=np.zeros(3), wxyz=np.array([1.0, 0.0, 0.0, 0.0]), visible=True)
        vars(self.added[name]).update(given)
        return self.added[name]

    def add_frame(self, name, **given):
        return self._keep(name, **given)

    def add_mesh_simple(self, name, vertices, faces, **given):
        return self._keep(name, vertices=vertices, faces=faces, **given)

    add_batched_meshes_simple = add_mesh_simple

    def add_label(self, name, text, **given):
        return self._keep(name, text=text, **given)


@pytest.fixture
def nodes():
    return Nodes()


@pytest.fixture
def puppet(nodes, scene):
    return Puppet(nodes, scene, solids(scene.robot.urdf, Path(), scene.size))


def test_the_panel_tells_a_row_with_its_gap_and_what_is_left(found, scene):
    told = panel.of_row(scene, 67, 1000.0)
    for said in (
        "row 69</b> of the file",
        f"{1e6 * np.linalg.norm(found.rows.gap[67]):.1f} µm",
        f"{1e6 * np.linalg.norm(found.rows.remainder[67]):.1f} µm",
        "drawn 1000 times as long: 100 µm as 100 mm",
    ):
        assert said in told
    assert "set aside" not in told
    far = panel.of_row(scene, int(np.flatnonzero(scene.aside)[0]), 5000.0)
    assert "set aside" in far
    assert "is cut at" in far


def test_the_panel_tells_places_largest_first_and_nothing_that_was_not_diagnosed(scene):
    told, known = panel.of_places(scene), [place for place, share in scene.shares.items() if share >= 0.005]
    at = [told.index(name) for _, name in known]
    assert at == sorted(at)
    assert f"{100 * max(scene.shares.values()):.1f} %" in told
    assert list(panel.names_of_places(scene)) == known
    assert "set aside" in panel.of_arrows(scene)
    bare = replace(scene, remainder=None, shares={}, aside=np.zeros_like(scene.aside))
    assert panel.of_places(bare) == ""
    assert panel.names_of_places(bare) == {}
    assert "after correction" not in panel.of_row(bare, 0, 1.0) + panel.of_arrows(bare)
    assert "set aside" not in panel.of_arrows(bare)
    odd = replace(scene, title="<script>", summary="a < b & c", shares={("link", "<b>x"): 0.5})
    for text in (panel.of_campaign(odd), panel.of_places(odd)):
        assert "<script>" not in text
        assert "<b>x" not in text
    assert "a &lt; b &amp; c" in panel.of_campaign(odd)


def test_links_and_joints_take_the_pose_of_a_row_and_the_pointer_ends_at_the_target(puppet, nodes, scene):
    for row in (0, 31):
        puppet.pose(row)
        for k, pose in enumerate(scene.links(row)):
            node = nodes.added[f"/links/{k}"]
            np.testing.assert_allclose(node.position, pose[:3, 3], atol=1e-12)
            np.testing.assert_allclose(quaternion_to_rotation(node.wxyz), pose[:3, :3], atol=1e-9)
        for j, (origin, axis) in enumerate(zip(*scene.joints(row), strict=True)):
            node = nodes.added[f"/joints/{j}"]
            np.testing.assert_allclose(node.position, origin, atol=1e-12)
            np.testing.assert_allclose(quaternion_to_rotation(node.wxyz)[:, 2], axis, atol=1e-9)
    tool = scene.robot.urdf_links.index(scene.robot.tool_frame)
    pose = scene.links(31)[tool]
    ends = nodes.added[f"/links/{tool}/pointer"].vertices @ pose[:3, :3].T + pose[:3, 3]
    assert np.linalg.norm(ends - scene.predicted[31], axis=1).min() < 0.005 * scene.size


def test_places_have_the_colours_of_their_shares_and_names_that_can_be_hidden(puppet, nodes, scene):
    coloured, robot = colours(scene.shares), scene.robot
    for k, link in enumerate(robot.urdf_links):
        if f"/links/{k}/shape" in nodes.added:
            assert nodes.added[f"/links/{k}/shape"].color == coloured.get(("link", link), NO_SHARE)
    for j, joint in enumerate(robot.joint_names):
        ring = nodes.added[f"/joints/{j}/ring"]
        assert ring.color == coloured.get(("joint", joint), NO_SHARE)
        outer, tube = 0.05 * scene.size, 0.005 * scene.size
        np.testing.assert_allclose(ring.vertices.max(axis=0), [outer, outer, tube], atol=1e-3 * scene.size)
    names = {name: node for name, node in nodes.added.items() if hasattr(node, "text")}
    assert sorted(label.text for label in names.values()) == sorted(panel.names_of_places(scene).values())
    joint = next(name for kind, name in scene.shares if kind == "joint")
    assert names[f"/joints/{robot.joint_names.index(joint)}/name_joint"].text.startswith(joint)
    for shown in (False, True):
        puppet.name(shown)
        assert {label.visible for label in names.values()} == {shown}


@pytest.mark.parametrize("kind", ["tool", "base", "instrument"])
def test_a_place_beside_joints_and_links_is_named_too(nodes, scene, kind):
    Puppet(nodes, replace(scene, shares={(kind, kind): 0.3}), {})
    assert [node.text for node in nodes.added.values() if hasattr(node, "text")] == [f"{kind} 30.0 %"]


def test_the_foot_has_the_colour_of_the_base_and_a_target_at_the_tool_no_pointer(nodes, scene):
    shares = {("base", "base"): 0.5, ("joint", "joint_2"): 0.1}
    shapes = solids(scene.robot.urdf, Path(), scene.size)
    Puppet(nodes, replace(scene, shares=shares, target=np.zeros(3)), shapes)
    found = {link: nodes.added.get(f"/links/{k}/shape") for k, link in enumerate(scene.robot.urdf_links)}
    coloured = {link for link, node in found.items() if node is not None and node.color != NO_SHARE}
    assert coloured == {"base_link"}
    assert found["base_link"].color == colours(shares)["base", "base"]
    assert not any(name.endswith("pointer") for name in nodes.added)


def test_arrows_lead_from_predicted_to_measured_and_rows_set_aside_are_grey(nodes, scene):
    def ends(node):
        along = np.asarray(node.batched_scales) * [0.0, 0.0, 1.0]
        return node.batched_positions + np.einsum("nij,nj->ni", quaternion_to_rotation(node.batched_wxyzs), along)

    Cloud(nodes, "/gap/all", scene, scene.gap, GAP).show(np.arange(len(scene.q)), 1.0, True)
    node = nodes.added["/gap/all"]
    np.testing.assert_allclose(node.batched_positions, scene.predicted, atol=1e-12)
    np.testing.assert_allclose(ends(node), scene.predicted + scene.gap, atol=1e-12)
    np.testing.assert_array_equal((node.batched_colors == linear(ASIDE)).all(axis=1), scene.aside)
    np.testing.assert_array_equal((node.batched_colors == linear(GAP)).all(axis=1), ~scene.aside)
    cloud = Cloud(nodes, "/gap/row", scene, scene.gap, GAP)
    for row, magnification, visible in ((0, 100.0, True), (41, 900.0, False), (5, 2.0, True)):
        cloud.show(np.array([row]), magnification, visible)
        node, told = nodes.added["/gap/row"], magnification * scene.gap[row]
        assert np.linalg.norm(told) < LONGEST_ARROW * scene.size
        np.testing.assert_allclose(ends(node)[0], scene.predicted[row] + told, atol=1e-9)
        assert node.visible is visible
    assert len(nodes.added) == 2


@pytest.fixture
def opened():
    """Open windows, and close them in the end."""
    pytest.importorskip("viser", reason="the viewer needs viser, which is in the extra viewer")
    windows = []

    def opened(scene, port=0):
        windows.append(Window(scene, solids(scene.robot.urdf, Path(), scene.size), port))
        return windows[-1]

    yield opened
    for window in windows:
        window.close()


def port_of(window):
    address, port = window.url.removeprefix("http://").split(":")
    assert address == "127.0.0.1"
    return int(port)


def test_it_says_where_it_is_served_and_prints_nothing(opened, scene, capsys):
    first = opened(scene)
    second = opened(scene, port_of(first))  # which is taken
    assert port_of(first) != port_of(second)
    for window in (first, second):
        with socket.create_connection(("127.0.0.1", port_of(window)), timeout=10):
            pass
    assert capsys.readouterr() == ("", "")


def test_a_browser_that_asks_for_a_public_address_gets_none(opened, scene):
    window = opened(scene)
    from viser import _messages

    server, asked = window._server, []
    stays = server.request_share_url
    vars(server)["request_share_url"] = lambda: asked.append(stays())
    for heard in server._websock_server._incoming_handlers[_messages.ShareUrlRequest]:
        heard(0, _messages.ShareUrlRequest())
    server._thread_executor.shutdown(wait=True)  # until it has been answered
    assert asked == [None]  # what is asked for is what was put in its place
    assert server._share_tunnel is None


def test_controls_go_to_rows_stretch_arrows_and_hide_them(opened, scene):
    window = opened(scene)
    rows = []
    for where in (BACK, ON, WORST):
        window._go(where)
        rows.append(window.row)
    kept = np.flatnonzero(~scene.aside)
    assert rows == [0, 1, int(kept[np.argmax(np.linalg.norm(scene.gap[kept], axis=1))])]
    assert f"row {scene.rows[rows[2]]}<" in window._told.content
    window._slider.value = len(scene.rows)
    window._changed()
    window._go(ON)
    assert window.row == len(scene.rows) - 1
    nodes = window._server.scene._handle_from_node_name
    window._slider.value = 1
    window._changed()
    before = np.array(nodes["/gap/row"].batched_scales)[0, 2]
    np.testing.assert_allclose(before, window.magnification * np.linalg.norm(scene.gap[0]), rtol=1e-5)
    assert (nodes["/gap/all"].visible, nodes["/after/row"].visible) == (True, False)
    window._magnify.value = 2.0 * window.magnification
    window._after.value, window._all.value = True, False
    window._changed()
    np.testing.assert_allclose(np.array(nodes["/gap/row"].batched_scales)[0, 2], 2.0 * before, rtol=1e-5)
    shown = {name for name, node in nodes.items() if name.startswith(("/gap", "/after")) and node.visible}
    assert {"/gap/row", "/after/row"} <= shown
    assert not {"/gap/all", "/after/all"} & shown


def test_a_campaign_of_one_row_is_shown(opened, scene):
    arrays = ("rows", "q", "predicted", "gap", "aside")
    one = replace(scene, **{name: getattr(scene, name)[:1] for name in arrays}, remainder=None)
    assert not opened(one)._slider.visible
