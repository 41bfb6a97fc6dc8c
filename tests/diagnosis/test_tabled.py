"""A diagnosis as data frames agrees with its findings and its rows."""

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.diagnosis.tabled import fitted_frames


@pytest.fixture(scope="module")
def diagnosis():
    return tr.diagnose(tr.demo_campaign())


def test_parameters_are_those_of_the_findings(diagnosis):
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


def test_the_covariance_is_one_and_has_the_stated_deviations(diagnosis):
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


def test_the_correlations_are_those_of_a_plain_least_squares_fit(diagnosis):
    """One column for each parameter and each unknown frame, weak priors: (Jᵀ J)⁻¹ has nearly the same correlations."""
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


def test_residuals_have_the_rms_that_is_told(diagnosis):
    table = diagnosis.residuals
    kept = table[~table["set_aside"]]
    for kind, wanted in (("gap", diagnosis.gap.rms_before), ("remainder", diagnosis.gap.rms_after)):
        distance = np.linalg.norm(kept[[f"{kind}.{axis}" for axis in "xyz"]], axis=1)
        np.testing.assert_allclose(np.sqrt(np.mean(distance**2)), wanted, rtol=1e-9)
    assert table.index[table["set_aside"]].tolist() == list(diagnosis.outliers)


ANGLES = ["roll", "pitch", "yaw"]


def test_a_point_has_no_direction_on_the_tool(diagnosis):
    frames = diagnosis.frames
    assert frames.loc["tool", ANGLES].isna().all()
    assert frames.loc["base"].notna().all()
    assert frames.loc["tool", ["x", "y", "z"]].notna().all()


def test_a_direction_that_was_measured_or_declared_is_told(diagnosis):
    import dataclasses

    model = diagnosis.model
    declared = dataclasses.replace(model.settings, tool_known=True)
    for known in (dataclasses.replace(model, measures="pose"), dataclasses.replace(model, settings=declared)):
        assert fitted_frames(known).loc["tool", ANGLES].notna().all()


def test_one_without_its_fit_says_so(diagnosis):
    import dataclasses

    with pytest.raises(ValueError, match="without its fit"):
        _ = dataclasses.replace(diagnosis, fit=None).covariance
