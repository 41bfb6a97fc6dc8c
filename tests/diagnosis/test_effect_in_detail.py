"""The figure of one effect shows the error at its place, before and after, against what drives it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from helpers import disturbed, some, with_law
from matplotlib.backends.backend_agg import FigureCanvasAgg
from simulate import demo, simulate

from thermal_robot.diagnosis.attribution import Explained, explained
from thermal_robot.effects import Effect, Parameter, at_joint, choose
from thermal_robot.effects.law import Discovered
from thermal_robot.errors import EffectError
from thermal_robot.inference.fit import fit
from thermal_robot.report.plots import explain_figure

MRAD = 1e3


def shown(robot, name, seed=2, **how):
    """The figure of an effect that is alone at work, what it shows, and the truth."""
    campaign, truth, _ = simulate(robot, [name], seed=seed, ratio=(4.0, 6.0), **how)
    found = explained(fit(campaign, choose((name,), (), ())), name)
    return explain_figure(found), found, truth["parts"][name]["values"], campaign


def points(axes, label):
    line = next(line for line in axes.get_lines() if line.get_label() == label)
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


@pytest.mark.parametrize("name", ["backlash", "joint_gain"])
def test_play_sets_two_sides_apart_a_gain_is_a_slope_and_nothing_is_left_of_either(rv_m2, name):
    joint, kind = {"backlash": ("joint_3", "lost motion"), "joint_gain": ("joint_2", "gain error")}[name]
    figure, found, values, _ = shown(rv_m2, name, places=[joint])
    axes, true = figure.axes[0], values[f"{kind}, {joint}"] * MRAD
    assert axes.get_title(loc="left").startswith(f"{joint}: ")
    assert axes.get_ylabel() == "error (mrad)"
    assert axes.get_xlabel() == {"backlash": f"approach.{joint}", "joint_gain": f"position of {joint} (rad)"}[name]
    for label, expected in (("as measured", true), ("with this effect taken off", 0.0)):
        x, y = points(axes, label)
        assert len(x) == len(found.places[0].before)
        (slope, _), covariance = np.polyfit(x, y, 1, cov=True)
        slope, sigma = np.array([slope, np.sqrt(covariance[0, 0])]) * (-2.0 if name == "backlash" else 1.0)
        assert abs(slope - expected) < 3.0 * abs(sigma)
    if name == "backlash":
        assert list(axes.get_xticks()) == [-1.0, 1.0]
        x, law = points(axes, "fitted law")
        assert np.nanmean(law[x < 0]) - np.nanmean(law[x > 0]) == pytest.approx(true, rel=0.1)


@pytest.mark.parametrize(
    ("joint", "unit", "drawn"), [("slide", "m", ("µm", "mm")), ("turret", "rad", ("µrad", "mrad"))]
)
def test_the_error_of_a_joint_is_a_length_where_it_slides_and_else_an_angle(awkward, joint, unit, drawn):
    figure, found, _, _ = shown(awkward, "backlash", places=[joint])
    first = found.places[0]
    assert (first.name, first.unit) == (joint, unit)
    assert figure.axes[0].get_ylabel() in [f"error ({word})" for word in drawn]


def test_the_spread_is_that_of_the_points(rv_m2):
    for name in ("backlash", "joint_offset"):
        _, found, _, _ = shown(rv_m2, name)
        place = found.places[0]
        assert 0.85 < np.std(place.after / place.spread) < 1.15
        assert np.std(place.before) >= 0.99 * np.std(place.after) or name == "joint_offset"


def test_links_grow_with_temperature_as_they_were_made_to(rv_m2):
    figure, found, values, campaign = shown(rv_m2, "thermal_elongation")
    segments = {s.parent_link: s for s in rv_m2.segments if s.length > 0.05}
    checked = 0
    for place, axes in zip(found.places, figure.axes, strict=False):
        segment = segments.get(place.name)
        name = segment and f"strain per kelvin of {segment.name}, {place.name}"
        alone = [s for s in rv_m2.segments if s.parent_link == place.name and s.length > 1e-9]
        if name not in values or len(alone) != 1:
            continue
        warmer = place.values - campaign.reference_temperature
        scale = 1.0 / place.spread
        slope = (scale**2 * warmer * place.before).sum() / (scale**2 * warmer**2).sum()
        assert slope == pytest.approx(values[name] * segment.length, rel=0.25)
        assert place.unit == "m"
        assert axes.get_xlabel() == "temperature (°C)"
        checked += 1
    assert checked >= 4


def test_drift_and_scale_and_torque_have_their_own_axes(rv_m2):
    for name, label in (
        ("drift", "time (s)"),
        ("instrument_scale", "distance from the instrument (m)"),
        ("joint_compliance", "torque of "),
    ):
        figure, found, _, _ = shown(rv_m2, name)
        assert figure.axes[0].get_xlabel().startswith(label)
        place = found.places[0]
        assert np.std(place.after) < 0.6 * np.sqrt(np.mean(place.before**2))
        law = np.interp(place.values, *place.line)
        assert np.std(place.before - law - place.after) < 0.05 * np.ptp(place.line[1])


def test_tracking_lag_is_drawn_against_speed(rv_m2):
    figure, found, values, _ = shown(rv_m2, "tracking_lag", moving=True)
    place = found.places[0]
    assert figure.axes[0].get_xlabel() == f"velocity.{place.name} (rad/s)"
    fast = np.abs(place.values) > 0.1
    jump = -np.sign(place.values) * values[f"friction, {place.name}"] - values[f"delay, {place.name}"] * place.values
    assert np.corrcoef(place.before[fast], jump[fast])[0, 1] > 0.8


def test_one_coefficient_for_all_links_is_drawn_link_by_link(rv_m2):
    _, found, values, _ = shown(rv_m2, "thermal_elongation", variant=1)
    lengths = {}
    for segment in rv_m2.segments:
        lengths[segment.parent_link] = lengths.get(segment.parent_link, 0.0) + segment.length
    assert len(found.places) >= 3
    (strain,) = values.values()
    for place in found.places:
        assert place.kind == "link"
        assert (place.quantity, place.quantity_unit) == ("temperature", "°C")
        alone = [s for s in rv_m2.segments if s.parent_link == place.name and s.length > 1e-9]
        if len(alone) == 1:
            slope = np.polyfit(*place.line, 1)[0]
            assert slope == pytest.approx(strain * lengths[place.name], rel=0.2)
    shares = [place.share for place in found.places]
    assert shares == sorted(shares, reverse=True)
    assert sum(shares) < 1.0 + 1e-9


@dataclass(frozen=True)
class Coupled(Effect):
    """Two joints that one belt moves: an effect of somebody's own, which says nothing of what drives it."""

    name = "coupled"

    def parameters(self, observations):
        stretch = np.sin(observations.q[:, 1])
        return (Parameter("stretch", "rad", 1e-3, "joint", "joint_2", (at_joint(1, stretch), at_joint(3, -stretch))),)


def coupled(robot):
    campaign, _, _ = simulate(robot, samples=80, seed=2)
    return fit(disturbed(campaign, [(Coupled(), np.array([2e-3]))]), (Coupled(),))


def test_an_effect_that_says_nothing_is_drawn_against_what_goes_with_it(rv_m2):
    place = explained(coupled(rv_m2), "coupled").places[0]
    assert (place.name, place.quantity, place.quantity_unit) == ("joint_2", "joint_2", "rad")
    assert place.unit == "m at the tool"
    assert np.std(place.after) < 0.6 * np.std(place.before)


def test_a_law_that_was_discovered_is_drawn_against_its_quantity(rv_m2):
    law = Discovered(kind="joint", place="joint_3", quantity="time", shape="step", marks=(3600.0,), span=7200.0)
    data, _, _ = with_law(rv_m2, law, [0.0, 6e-4], seed=3)
    place = explained(fit(data, (law,)), law.name).places[0]
    assert (place.name, place.quantity, place.quantity_unit) == ("joint_3", "time", "s")
    late = place.values > 3600.0
    assert place.before[late].mean() - place.before[~late].mean() == pytest.approx(6e-4, rel=0.1)


def test_where_an_effect_is_not_part_of_the_explanation_it_says_which_are(rv_m2):
    campaign, _, _ = simulate(rv_m2, ["backlash"], seed=2)
    with pytest.raises(EffectError, match="'drift' is not part of the explanation, which holds backlash"):
        explained(fit(campaign, choose((), (), ())), "drift")


def test_gross_errors_are_left_out():
    campaign = demo()[0]
    known = fit(campaign, choose((), (), ()))
    place = explained(known, "backlash").places[0]
    assert len(place.before) == campaign.samples - known.explanation.outliers.sum()
    assert known.explanation.outliers.any()


@pytest.fixture(scope="module")
def one(rv_m2):
    return shown(rv_m2, "backlash", places=["joint_3"])[1].places[0]


@pytest.mark.parametrize("count", some([8, 1, 4], 2))
def test_no_text_meets_another_and_every_axis_has_a_unit(one, count):
    many = tuple(
        replace(one, name=f"left_arm_{k}_joint", quantity=f"approach.left_arm_{k}_joint") for k in range(count)
    )
    figure = explain_figure(Explained("backlash", many, 2))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    drawn = [axes for axes in figure.axes if axes.axison]
    assert len(drawn) == count
    titles = [axes._left_title.get_window_extent(renderer) for axes in drawn]
    labels = [axes.xaxis.label.get_window_extent(renderer) for axes in drawn]
    for boxes in (titles, labels):
        assert all(box.x0 > -1.0 and box.x1 < figure.bbox.x1 + 1.0 for box in boxes)
        assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    assert drawn[0].get_ylabel() == "error (mrad)"
    assert "2 smaller places are not shown" in figure._suptitle.get_text()
    # without a material place the figure is empty
    assert explain_figure(Explained("backlash", (), 0))._repr_png_().startswith(b"\x89PNG")


def above_its_zero(observed):
    return 100.0 + observed.covariates["temperature"]


@dataclass(frozen=True)
class Follows(Effect):
    """An error in one joint that is proportional to a temperature whose zero is far away."""

    name = "follows"
    needs = ("temperature",)
    joint: str = "joint_1"
    places: tuple[str, ...] = ()

    def parameters(self, observations):
        index = observations.robot.joint_names.index(self.joint)
        response = at_joint(index, above_its_zero(observations))
        return (Parameter("slope", "rad/K", 1e-5, "joint", self.joint, (response,)),)


@pytest.mark.parametrize(("joint", "centred"), [("joint_1", True), ("joint_3", False)])
def test_a_constant_that_an_unknown_base_takes_up_squeezes_no_figure(rv_m2, joint, centred):
    campaign, _, _ = simulate(rv_m2, [], seed=5)
    effect, slope = Follows(joint=joint), np.array([2e-5])
    campaign = disturbed(campaign, [(effect, slope)])
    truth = slope * above_its_zero(campaign)
    found = explained(fit(campaign, (effect,)), "follows")
    (place,) = found.places
    assert place.centred is centred
    assert np.polyfit(*place.line, 1)[0] == pytest.approx(2e-5, rel=0.1)
    assert np.mean(place.line[1]) == pytest.approx(0.0 if centred else truth.mean(), abs=0.15 * np.ptp(truth))
    (axes,) = explain_figure(found).axes
    law = next(line for line in axes.get_lines() if line.get_label() == "fitted law").get_ydata()
    filled = np.ptp(law) / np.ptp(axes.get_ylim())
    assert (filled > 0.4) if centred else (filled < 0.1)
    assert axes.get_ylabel().startswith("error less its mean (" if centred else "error (")
