"""One frozen value: told by whoever is asked to, as JSON without loss, and as data frames that agree."""

import json
from dataclasses import FrozenInstanceError, replace

import jsonschema
import numpy as np
import pytest
from helpers import numbers

import thermal_robot as tr
from thermal_robot import renderer
from thermal_robot.diagnosis.result import frame_table, with_summary
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.renderer import register_renderer
from thermal_robot.report import schema


class Parrot:
    """A renderer that says whom it was asked about."""

    def headline(self, diagnosis):
        return f"headline of {diagnosis.campaign}"

    def advice(self, diagnosis):
        return f"advice for {diagnosis.campaign}"

    def text(self, diagnosis):
        return f"text of {diagnosis.campaign}"

    def fragment(self, diagnosis):
        return f"<p>{diagnosis.campaign}</p>"

    def explain_figure(self, explained):
        return f"figure of {explained.effect}"

    def html(self, diagnosis):
        return f"<html>{diagnosis.campaign}</html>"

    def overview(self, diagnosis):
        return f"drawing of {diagnosis.campaign}"


@pytest.fixture
def nobody(monkeypatch):
    monkeypatch.setattr(renderer, "_renderers", [])


def test_without_a_renderer_it_says_what_to_do(hall, nobody):
    for ask in (
        with_summary,
        str,
        lambda d: d._repr_html_(),
        lambda d: d.to_html(),
        lambda d: d.plot(),
        lambda d: d.explain("backlash"),
    ):
        with pytest.raises(RuntimeError, match="import thermal_robot, or call register_renderer"):
            ask(hall)
    assert "backlash" in repr(hall)
    assert hall.to_dict()["verdict"]["summary"] == hall.summary


def test_whoever_was_named_last_is_asked(hall, nobody):
    class Other(Parrot):
        def headline(self, diagnosis):
            return "other"

    register_renderer(Parrot())
    said = with_summary(replace(hall, summary="", advice=""))
    assert (said.summary, said.advice) == (f"headline of {hall.campaign}", f"advice for {hall.campaign}")
    assert str(hall) == f"text of {hall.campaign}"
    assert hall._repr_html_() == f"<p>{hall.campaign}</p>"
    assert hall.to_html() == f"<html>{hall.campaign}</html>"
    assert hall.plot() == f"drawing of {hall.campaign}"
    assert hall.explain("backlash") == "figure of backlash"
    register_renderer(Other())
    assert with_summary(hall).summary == "other"
    assert said.effects == hall.effects


def test_json_holds_all_and_nothing_that_json_cannot(hall, tmp_path):
    hall.to_json(tmp_path / "diagnosis.json")
    text = (tmp_path / "diagnosis.json").read_text(encoding="utf-8")
    assert hall.to_json() == text
    again = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert again == hall.to_dict()
    jsonschema.validate(again, schema())
    assert again["schema"] == "thermal-robot/diagnosis/2"
    assert tuple(again["verdict"]["effects"]) == hall.verdict
    assert [e["name"] for e in again["effects"]] == [f.name for f in hall.effects]
    assert again["gap"]["held_out"]["shrinkage"] == hall.gap.held_out.shrinkage
    assert len(numbers(again)) > 100
    gap = again["gap"]
    assert gap["orientation"] is None  # it was not measured
    assert (gap["rms_before"], gap["noise_floor"]) == (hall.gap.rms_before, hall.gap.noise_floor)
    assert [scheme["name"] for scheme in gap["schemes"]] == [scheme.name for scheme in hall.gap.schemes]
    with pytest.raises(FrozenInstanceError):
        hall.verdict = ()


@pytest.mark.parametrize("no_number", [float("nan"), float("inf")])
def test_what_is_no_number_becomes_null(hall, no_number):
    left = replace(hall.unexplained, p_value=no_number, rms=no_number)
    plain = replace(hall, unexplained=left).to_dict()
    assert (plain["unexplained"]["p_value"], plain["unexplained"]["rms"]) == (None, None)
    json.dumps(plain, allow_nan=False)


def test_without_a_fit_nothing_is_proposed(hall):
    bare = replace(hall, fit=None)
    assert bare.to_dict()["next"]["samples"] == []
    for ask in (bare.next_samples, lambda: bare.explain("backlash"), lambda: bare.covariance):
        with pytest.raises(ValueError, match="without its fit"):
            ask()
    assert len(hall.next_samples(3).samples) == 3
    for count in (0, -1, 2.5):
        with pytest.raises(CampaignError, match=rf"cannot propose so many; found {count}, expected a whole number"):
            hall.next_samples(count)


def test_effects_are_asked_for_by_name(hall):
    assert hall.finding("backlash").name == "backlash"
    with pytest.raises(KeyError):
        hall.finding("gremlins")
    with pytest.raises(EffectError, match=r"^no effect named 'backlsh' was considered; did you mean 'backlash'\?$"):
        hall.finding("backlsh")
    with pytest.raises(EffectError, match=r"no effect named 'xx' was considered; there are .*joint_gain"):
        hall.finding("xx")
    assert hall.title("backlash") == hall.finding("backlash").title != ""
    assert hall.title("somebodys_own") == "somebodys own"
    assert hall.is_frame("base_frame")
    assert not hall.is_frame("backlash")


@pytest.fixture(scope="module")
def diagnosis(diagnosed_once):
    return diagnosed_once(tr.demo_campaign())


def test_the_tables_are_those_of_the_findings(diagnosis):
    # parameters are those of the findings
    table = diagnosis.parameters
    assert len(table) == sum(len(finding.parameters) for finding in diagnosis.effects)
    told = diagnosis.finding("backlash")
    for estimate in told.parameters:
        row = table.loc[("backlash", estimate.name)]
        assert bool(row["identified"]) == estimate.identified
        if estimate.identified:
            assert (row["value"], row["std"], row["unit"]) == (estimate.value, estimate.std, estimate.unit)
        else:
            assert np.isnan(row["value"])
    assert set(table["status"]) <= {"found", "confounded", "contained"}
    # residuals have the rms that is told
    table = diagnosis.residuals
    kept = table[~table["set_aside"]]
    for kind, wanted in (("gap", diagnosis.gap.rms_before), ("remainder", diagnosis.gap.rms_after)):
        distance = np.linalg.norm(kept[[f"{kind}.{axis}" for axis in "xyz"]], axis=1)
        np.testing.assert_allclose(np.sqrt(np.mean(distance**2)), wanted, rtol=1e-9)
    assert table.index[table["set_aside"]].tolist() == list(diagnosis.outliers)


def test_the_covariance_is_one_has_the_stated_deviations_and_the_correlations_of_least_squares(diagnosis):
    # the covariance is one and has the stated deviations
    covariance, table = diagnosis.covariance, diagnosis.parameters
    known = table[table["identified"] & table["status"].isin(["found", "confounded"])]
    assert set(covariance.index) == set(known.index)
    assert covariance.index.equals(covariance.columns)
    matrix = covariance.to_numpy()
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-9)
    np.testing.assert_allclose(np.sqrt(matrix.diagonal()), table.loc[covariance.index, "std"], rtol=1e-12)
    correlation = matrix / np.sqrt(np.outer(matrix.diagonal(), matrix.diagonal()))
    assert np.linalg.eigvalsh(correlation).min() > 0.0
    assert np.abs(correlation - np.eye(len(correlation))).max() < 1.0
    # One column for each parameter and each unknown frame, weak priors: (Jᵀ J)⁻¹ has nearly the same correlations.
    from thermal_robot.inference.columns import block, frame_columns

    fit = diagnosis.fit
    seen = fit.corrected
    columns = [frame_columns(seen)[0][:, :3], *(block(seen, effect).columns[:, :3] for effect, _ in fit.effects)]
    design = np.concatenate(columns, axis=2)[~diagnosis.rows.outliers]
    design = design.reshape(-1, design.shape[2])
    size = np.sqrt((design**2).sum(axis=0))
    inverse = np.linalg.pinv((design / size).T @ (design / size), rcond=1e-10)
    names = [(e.name, p.name) for e, _ in fit.effects for p in fit.explanation.linear.blocks[_block(fit, e)].parameters]
    own = inverse[-len(names) :, -len(names) :]
    plain = own / np.sqrt(np.outer(own.diagonal(), own.diagonal()))
    told = diagnosis.covariance
    kept = [names.index(name) for name in told.index]
    std = np.sqrt(told.to_numpy().diagonal())
    np.testing.assert_allclose(told.to_numpy() / np.outer(std, std), plain[np.ix_(kept, kept)], atol=0.15)


def _block(fit, effect):
    return fit.explanation.best.blocks[[e.name for e, _ in fit.effects].index(effect.name)]


ANGLES = ["roll", "pitch", "yaw"]


def test_a_point_has_no_direction_on_the_tool_unless_it_was_measured_or_declared(diagnosis):
    frames, model = diagnosis.frames, diagnosis.model
    assert frames.loc["tool", ANGLES].isna().all()
    assert frames.loc["base"].notna().all()
    assert frames.loc["tool", ["x", "y", "z"]].notna().all()
    declared = replace(model.settings, tool_known=True)
    for known in (replace(model, measures="pose"), replace(model, settings=declared)):
        assert frame_table(known).loc["tool", ANGLES].notna().all()
