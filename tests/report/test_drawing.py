"""What figures share: names are no formulas, axes are read at sight, long campaigns are thinned fairly."""

import numpy as np
import pytest

from thermal_robot.report.drawing import Drawing, log_axis, note, plain, thinned, tidy, title


def test_a_drawing_shows_itself_without_a_display():
    figure = Drawing(2.0, 1.0)
    figure.subplots()
    shown = figure._repr_png_()
    assert shown.startswith(b"\x89PNG")
    width, height = (int.from_bytes(shown[k : k + 4], "big") for k in (16, 20))
    assert (width, height) == (220, 110)


def test_a_name_with_dollar_signs_is_drawn_as_it_stands():
    figure = Drawing(4.0, 2.0)
    axes = figure.subplots()
    title(axes, "$a^_1$")
    note(axes, "$x$")
    figure.draw_without_rendering()  # a broken formula would be an error
    for text, name in ((axes._left_title, "$a^_1$"), (axes.texts[0], "$x$")):
        assert text._preprocess_math(text.get_text()) == (name, False)
    assert plain("no sign") == "no sign"


def test_an_empty_panel_says_why_in_its_middle():
    axes = Drawing(2.0, 1.0).subplots()
    note(axes, "nothing was measured")
    assert not axes.axison
    assert [t.get_text() for t in axes.texts] == ["nothing was measured"]
    assert axes.texts[0].get_position() == (0.5, 0.5)


@pytest.mark.parametrize(("grid", "shown"), [("x", (True, False)), ("y", (False, True)), ("both", (True, True))])
def test_tidy_axes_have_two_spines_and_the_grid_that_was_asked_for(grid, shown):
    axes = Drawing(2.0, 1.0).subplots()
    tidy(axes, grid)
    assert [side for side, spine in axes.spines.items() if spine.get_visible()] == ["left", "bottom"]
    for axis, wanted in zip((axes.xaxis, axes.yaxis), shown, strict=True):
        assert any(line.get_visible() for line in axis.get_gridlines()) is wanted


@pytest.mark.parametrize(("low", "high"), [(3.0, 180.0), (0.004, 5.0), (1e-3, 1e3)])
def test_a_logarithmic_axis_is_labelled_with_numbers_read_at_sight(low, high):
    figure = Drawing(6.0, 2.0)
    axes = figure.subplots()
    log_axis(axes, low, high)
    figure.draw_without_rendering()
    shown = [t.label1.get_text() for t in axes.xaxis._update_ticks() if t.label1.get_text()]
    assert len(shown) >= 3
    assert all(text.strip("0.").rstrip("0") in ("1", "2", "5") for text in shown)
    assert all(low <= float(text) <= high for text in shown)


def test_few_points_are_all_drawn_and_many_are_thinned_fairly():
    assert np.array_equal(thinned(6000), np.arange(6000))
    many = thinned(60000)
    assert len(many) == len(np.unique(many)) == 6000
    assert np.all(np.diff(many) > 0)
    assert np.array_equal(many, thinned(60000))
    counts, _ = np.histogram(many, bins=10, range=(0, 60000))
    assert np.all(np.abs(counts - 600) < 5.0 * np.sqrt(600))


def test_a_figure_is_written_whole_under_the_name_that_matplotlib_gives_it(tmp_path):
    figure = Drawing(2.0, 1.0)
    for name in ("a.png", "b.pdf", "c"):
        figure.savefig(tmp_path / name)
    figure.savefig(str(tmp_path / "d"), format="svg")
    found = {file.name: file.read_bytes()[:4] for file in tmp_path.iterdir()}
    assert found == {"a.png": b"\x89PNG", "b.pdf": b"%PDF", "c.png": b"\x89PNG", "d": b"<?xm"}
