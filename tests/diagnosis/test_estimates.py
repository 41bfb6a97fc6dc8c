"""Parameters as they are told: identified ones alone have figures, and parts are those of their container."""

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.diagnosis.findings import estimates, fitted_values, told_inside
from thermal_robot.effects import named
from thermal_robot.inference.fit import fit_named


@pytest.fixture(scope="module")
def fit():
    off = {"joint_offset": {"joint_3": 1e-3}}
    campaign = tr.simulate("builtin:rv_m2", off, rows=60, noise=2e-5, base=np.eye(4), tool_frame="tool0", seed=8)
    return fit_named(campaign, [named("joint_offset"), named("geometric"), named("backlash")])


def test_figures_stand_where_the_data_identify(fit):
    for block in fit.explanation.best.blocks:
        told = estimates(fit, block)
        assert len(told) == len(fitted_values(fit, block))
        for one in told:
            assert (one.value is None, one.std is None) == (not one.identified, not one.identified)
    first = [one.name for one in estimates(fit, 0) if one.identified]
    assert 0 < len(first) < len(estimates(fit, 0))  # segments have redundant parameters


def test_parts_name_their_container(fit):
    parts = told_inside(fit)
    assert {name: part.container for name, part in parts.items()} == {
        "joint_offset": "geometric",
        "geometric": "geometric",
    }
    zero = next(one for one in parts["joint_offset"].parameters if one.name == "zero offset, joint_3")
    assert zero.value == pytest.approx(1e-3, abs=4.0 * zero.std)
