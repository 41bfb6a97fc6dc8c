"""What the panel says."""

from dataclasses import replace

import numpy as np

from thermal_robot.viewer import window as panel


def test_a_row_is_told_with_its_gap_and_what_is_left(found, scene):
    told = panel.of_row(scene, 67, 1000.0)
    assert "row 69" in told
    assert "row 69</b> of the file" in told
    assert f"{1e6 * np.linalg.norm(found.rows.gap[67]):.1f} µm" in told
    assert f"{1e6 * np.linalg.norm(found.rows.remainder[67]):.1f} µm" in told
    assert "drawn 1000 times as long: 100 µm as 100 mm" in told
    assert "set aside" not in told


def test_a_row_set_aside_and_an_arrow_that_is_cut_are_said_so(scene):
    told = panel.of_row(scene, int(np.flatnonzero(scene.aside)[0]), 5000.0)
    assert "set aside" in told
    assert "is cut at" in told


def test_places_stand_largest_first_with_their_shares(scene):
    told = panel.of_places(scene)
    at = [told.index(name) for (_, name), share in scene.shares.items() if share >= 0.005]
    assert at == sorted(at)
    assert f"{100 * max(scene.shares.values()):.1f} %" in told
    assert set(panel.names_of_places(scene)) == {place for place, share in scene.shares.items() if share >= 0.005}


def test_what_was_not_diagnosed_is_not_told(scene):
    bare = replace(scene, remainder=None, shares={}, aside=np.zeros_like(scene.aside))
    assert panel.of_places(bare) == ""
    assert panel.names_of_places(bare) == {}
    assert "after correction" not in panel.of_row(bare, 0, 1.0) + panel.of_arrows(bare)
    assert "set aside" not in panel.of_arrows(bare)


def test_names_are_text_and_no_markup(scene):
    odd = replace(scene, title="<script>", summary="a < b & c", shares={("link", "<b>x"): 0.5})
    for told in (panel.of_campaign(odd), panel.of_places(odd)):
        assert "<script>" not in told
        assert "<b>x" not in told
    assert "a &lt; b &amp; c" in panel.of_campaign(odd)
