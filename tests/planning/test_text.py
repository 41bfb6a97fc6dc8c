"""The text of a plan says what the plan holds."""

import re

import numpy as np

from thermal_robot.planning import plan, text


def test_each_effect_has_a_line_with_its_figures(planned):
    lines = text(planned).splitlines()
    for expected in planned.effects:
        own = next(line for line in lines if line.startswith(f"{expected.name} "))
        if expected.lacks:
            assert expected.lacks[0] in own
        for other in expected.confounded:
            assert other in own
    gain = planned.effect("joint_gain")
    own = next(line for line in lines if line.startswith("joint_gain ")).split()
    sigmas = [p.sigma for p in gain.parameters]
    assert f"{sum(p.told for p in gain.parameters)} of 5" in " ".join(own)
    np.testing.assert_allclose([float(own[3]), float(own[4])], [np.median(sigmas), max(sigmas)], rtol=0.06)


def test_the_opening_says_rows_repeats_and_sides(rv_m2):
    first = text(plan(rv_m2, 24, ["backlash"], repeats=3)).splitlines()[0]
    assert first.startswith("24 rows: 8 poses, each 3 times.")
    shares = [int(s) for s in re.findall(r"(\d+) to (\d+) %", first)[0]]
    assert 30 <= shares[0] <= shares[1] <= 70
