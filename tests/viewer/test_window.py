"""The scene on a server: what the controls do, and who is served."""

import socket
from pathlib import Path

import numpy as np
import pytest

from thermal_robot.viewer.window import solids

pytest.importorskip("viser", reason="the viewer needs viser, which is in the extra viewer")


@pytest.fixture
def opened():
    """Open windows, and close them in the end."""
    from thermal_robot.viewer.window import Window

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
    from viser import _messages

    window = opened(scene)
    server, asked = window._server, []
    stays = server.request_share_url
    vars(server)["request_share_url"] = lambda: asked.append(stays())
    for heard in server._websock_server._incoming_handlers[_messages.ShareUrlRequest]:
        heard(0, _messages.ShareUrlRequest())
    server._thread_executor.shutdown(wait=True)  # until it has been answered
    assert asked == [None]  # what is asked for is what was put in its place
    assert server._share_tunnel is None


def test_steps_go_to_rows_and_stay_within_the_table(opened, scene):
    from thermal_robot.viewer.window import BACK, ON, WORST

    window = opened(scene)
    window._go(BACK)
    assert window.row == 0
    window._go(ON)
    assert window.row == 1
    window._go(WORST)
    worst = window.row
    kept = np.flatnonzero(~scene.aside)
    assert not scene.aside[worst]
    assert np.linalg.norm(scene.gap[worst]) == np.linalg.norm(scene.gap[kept], axis=1).max()
    assert f"row {scene.rows[worst]}<" in window._told.content
    window._slider.value = len(scene.rows)
    window._changed()
    window._go(ON)
    assert window.row == len(scene.rows) - 1


def test_arrows_are_as_long_as_the_slider_says(opened, scene):
    window = opened(scene)
    handles = window._server.scene._handle_from_node_name
    before = np.array(handles["/gap/row"].batched_scales)[0, 2]
    np.testing.assert_allclose(before, window.magnification * np.linalg.norm(scene.gap[0]), rtol=1e-5)
    window._magnify.value = 2.0 * window.magnification
    window._changed()
    np.testing.assert_allclose(np.array(handles["/gap/row"].batched_scales)[0, 2], 2.0 * before, rtol=1e-5)


def test_boxes_show_and_hide(opened, scene):
    window = opened(scene)
    nodes = window._server.scene._handle_from_node_name
    assert (nodes["/gap/all"].visible, nodes["/after/row"].visible) == (True, False)
    window._after.value = True
    window._all.value = False
    window._changed()
    shown = {name for name, node in nodes.items() if name.startswith(("/gap", "/after")) and node.visible}
    assert {"/gap/row", "/after/row"} <= shown
    assert not {"/gap/all", "/after/all"} & shown


def test_a_campaign_of_one_row_is_shown(opened, scene):
    from dataclasses import replace

    arrays = ("rows", "q", "predicted", "gap", "remainder", "aside")
    window = opened(replace(scene, **{name: getattr(scene, name)[:1] for name in arrays}))
    assert not window._slider.visible
