"""What is shown, as numbers: the gap is measured − predicted, links are where Pinocchio has them, arrows end there."""

import socket
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from thermal_robot.campaign import Campaign
from thermal_robot.datasets import demo_campaign
from thermal_robot.diagnosis.result import with_summary
from thermal_robot.diagnosis.values import DataFault, Misfit
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import quaternion_to_rotation, tool_poses
from thermal_robot.viewer import window as panel
from thermal_robot.viewer.scene import arrows, readable, scene_of_campaign, scene_of_diagnosis, turned_along, unit_arrow
from thermal_robot.viewer.settings import ASIDE, FULL_SHARE, GAP, LONGEST_ARROW, NO_SHARE, colours, linear
from thermal_robot.viewer.window import BACK, ON, WORST, Cloud, Puppet, Window, solids

SIZE = 2.0
VECTORS = np.vstack([np.eye(3), -np.eye(3), np.zeros((1, 3)), np.random.default_rng(0).normal(size=(50, 3))]) * 1e-4


def test_the_gap_leads_from_predicted_to_measured_with_its_remainder_and_shares(found, scene):
    """In the measurement frame, as the fitted base has it."""
    campaign, base = demo_campaign(), found.fit.nominal.frames.base
    there = (scene.predicted + scene.gap) @ base[:3, :3].T + base[:3, 3]
    np.testing.assert_allclose(there, campaign.position, atol=1e-12)
    np.testing.assert_array_equal(scene.rows, campaign.rows)
    np.testing.assert_array_equal(scene.remainder, found.rows.remainder[:, :3])
    assert set(scene.rows[scene.aside]) == set(found.outliers)
    kept = ~scene.aside
    assert np.linalg.norm(scene.remainder[kept]) < 0.5 * np.linalg.norm(scene.gap[kept])
    poses = tool_poses(scene.robot, scene.q)
    np.testing.assert_allclose(poses[:, :3, :3] @ scene.target + poses[:, :3, 3], scene.predicted, atol=1e-12)
    shares = list(scene.shares.values())
    assert shares == sorted(shares, reverse=True)
    for kind, known in (("joint", found.where.joints), ("link", found.where.links)):
        assert {name: s for (k, name), s in scene.shares.items() if k == kind} == known
    by_effects = sum(place.share for f in found.effects for place in f.locations if f.name in found.verdict)
    assert sum(shares) == pytest.approx(by_effects)
    beyond = replace(found.where, beyond={"tool": 0.25})
    assert scene_of_diagnosis(replace(found, where=beyond)).shares["tool", "tool"] == 0.25


def test_joints_are_where_pinocchio_has_them(scene):
    model = pin.buildModelFromXML(scene.robot.urdf)
    data = model.createData()
    for row in (0, 17, len(scene.q) - 1):
        jacobian = pin.computeJointJacobians(model, data, scene.q[row])  # of each joint: moment of its axis, axis
        for j, (origin, axis) in enumerate(zip(*scene.joints(row), strict=True)):
            joint = model.getJointId(scene.robot.joint_names[j])
            np.testing.assert_allclose(origin, data.oMi[joint].translation, atol=1e-9)
            np.testing.assert_allclose(axis, jacobian[3:, j], atol=1e-9)


def test_axes_of_slides_and_coupled_joints_are_those_along_which_they_move(awkward, configurations):
    q = configurations(awkward, 1)
    known = {"position": np.arange(12.0).reshape(4, 3), "base_known": True, "tool_known": True}
    axes = scene_of_campaign(Campaign("a", awkward, np.repeat(q, 4, axis=0), **known)).joints(0)[1]
    for j, kind in enumerate(awkward.joint_types):
        step = 1e-6 * np.eye(awkward.n)[j]
        moved = (awkward.forward(q[0] + step) - awkward.forward(q[0] - step)) / 2e-6
        turned = moved[:3, :3] @ awkward.forward(q[0])[:3, :3].T
        along = moved[:3, 3] if kind == "prismatic" else np.array([turned[2, 1], turned[0, 2], turned[1, 0]])
        np.testing.assert_allclose(axes[j], along, atol=1e-6)


def test_without_a_diagnosis_or_where_the_table_does_not_fit_there_is_the_gap_alone(found):
    scene = scene_of_campaign(demo_campaign())
    assert (scene.remainder, scene.shares) == (None, {})
    assert not scene.aside.any()
    assert 50e-6 < np.sqrt(np.median((scene.gap**2).sum(axis=1))) < 80e-6
    with pytest.raises(CampaignError, match="nothing was measured"):
        scene_of_campaign(replace(demo_campaign(), position=None))
    fault = DataFault(("shifted rows",), "rows are shifted", "shift them back", 0.1, 1e-4)
    unusable = with_summary(replace(found, misfit=Misfit(fault)))
    scene = scene_of_diagnosis(unusable)
    assert scene.summary == unusable.reason
    assert "Shift them back" in scene.summary
    assert (scene.remainder, scene.shares) == (None, {})
    np.testing.assert_array_equal(scene.gap, found.rows.gap[:, :3])
    with pytest.raises(ValueError, match="without its fit"):
        scene_of_diagnosis(replace(found, fit=None))


def test_the_eye_sees_all_of_it_and_the_arm_does_not_point_there(scene):
    away = scene.eye - scene.centre
    assert 0.5 * scene.size < np.linalg.norm(away) < 1.5 * scene.size
    assert away @ scene.up > 0.0
    mean = scene.predicted.mean(axis=0)
    ahead, level = (of - (of @ scene.up) * scene.up for of in (mean, away))
    assert abs(ahead @ level) < 0.5 * np.linalg.norm(ahead) * np.linalg.norm(level)
    corners = np.array([scene.predicted.min(axis=0), scene.predicted.max(axis=0)])
    assert np.linalg.norm(np.ptp(corners, axis=0)) <= scene.size


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, 0.0, 9.81), (9.81, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_up_is_against_gravity(scene, gravity):
    turned = replace(scene, robot=replace(scene.robot, gravity=np.array(gravity)))
    assert np.linalg.norm(turned.up) == pytest.approx(1.0)
    assert turned.up @ gravity == pytest.approx(-np.linalg.norm(gravity))
    assert np.isfinite(turned.eye).all()
    around = replace(turned, predicted=np.zeros_like(scene.predicted))  # it reaches in no direction
    assert 0.5 * scene.size < np.linalg.norm(around.eye - around.centre) < 1.5 * scene.size


def tips(displacements, magnification):
    """Where the tips of arrows come to lie from their starts."""
    turns, stretches = arrows(displacements, magnification, SIZE)
    return np.einsum("nij,nj->ni", quaternion_to_rotation(turns), np.array([0.0, 0.0, 1.0]) * stretches)


def test_arrows_are_magnified_displacements_and_gross_errors_are_cut():
    for magnification in (1.0, 250.0):
        np.testing.assert_allclose(tips(VECTORS, magnification), magnification * VECTORS, atol=1e-12)
    long = tips(np.array([[3.0, 4.0, 0.0]]), 100.0)
    np.testing.assert_allclose(long, [LONGEST_ARROW * SIZE * np.array([0.6, 0.8, 0.0])], atol=1e-12)
    thin, thick = (arrows(VECTORS, 100.0, SIZE, by)[1] for by in (1.0, 3.0))
    assert (thin[:, 0] <= thin[:, 2]).all()  # none is wider than long
    assert (thick[:, 0] >= thin[:, 0]).all()
    assert (thick[:6, 0] > thin[:6, 0]).all()
    np.testing.assert_array_equal(thick[:, 2], thin[:, 2])
    turns = turned_along(VECTORS)
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)


def test_the_unit_arrow_is_closed_and_points_along_z():
    mesh = unit_arrow()
    assert mesh.is_watertight
    assert mesh.volume > 0.0  # seen from outside
    np.testing.assert_allclose(mesh.bounds, [[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]], atol=1e-12)
    assert mesh.center_mass[2] > 0.5  # the head is at the end


@pytest.mark.parametrize("scale", [1e-6, 3e-5, 1e-4, 7e-4, 1e-2])
def test_what_is_readable_is_a_round_number_that_fits(scale):
    given = scale / 1e-4 * VECTORS
    magnification = readable(given, SIZE)
    leading = magnification / 10.0 ** np.floor(np.log10(magnification) + 1e-9)
    assert min(abs(leading - step) for step in (1, 2, 5)) < 1e-9
    assert 0.02 * SIZE < np.quantile(arrows(given, magnification, SIZE)[1][:, 2], 0.9) < 0.1 * SIZE
    assert readable(np.zeros((4, 3)), SIZE) == readable(np.zeros((0, 3)), SIZE) == 1.0


def test_colours_are_ordered_by_share_and_pale_where_no_place_matters():
    def brightness(colour):
        """Relative luminance, ITU-R BT.709, of colours as they are stored."""
        return np.dot([0.2126, 0.7152, 0.0722], colour)

    shares = {("joint", f"j{k}"): share for k, share in enumerate([0.61, 0.2, 0.12, 0.05, 0.02, 0.0])}
    bright = [brightness(colour) for colour in colours(shares).values()]
    assert (np.diff(bright) > 0.0).all()  # the larger the share the darker, for those too who see no colours
    assert (colours(shares)["joint", "j0"], colours(shares)["joint", "j5"]) == (FULL_SHARE, NO_SHARE)
    pale = colours({("link", "a"): 0.01, ("link", "b"): 0.002, ("link", "c"): -1.0})
    assert min(map(brightness, pale.values())) > 0.5 * (brightness(NO_SHARE) + brightness(FULL_SHARE))
    assert pale["link", "c"] == NO_SHARE
    assert colours({}) == {}


def test_half_the_light_is_more_than_half_of_what_a_screen_takes():
    """Printed pairs of sRGB: 188 is half the light, 118 is 18 %, the grey card of photographers."""
    assert linear([0, 255, 188]).tolist() == [0, 255, 128]
    assert linear([118]).item() == round(0.18 * 255)
    assert (np.diff(linear(np.arange(256)).astype(int)) >= 0).all()


# ---- the window


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
