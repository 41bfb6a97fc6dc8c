"""A diagnosis at rest: it stays where it was, and nearly as probable combinations come with it."""

import numpy as np
import pytest

from thermal_robot.diagnosis.growing.stream import begun, can_grow, rivals


@pytest.mark.parametrize("which", ["found", "fresh"])
def test_a_diagnosis_is_where_its_own_choice_comes_to_rest(which, request):
    """Values within a ten-thousandth of a deviation, noise and remainder within a millionth."""
    diagnosis = request.getfixturevalue(which)
    e, rest = diagnosis.fit.explanation, begun(diagnosis.fit).fitted
    values = np.concatenate([v for _, v in diagnosis.fit.effects])
    deviation = np.concatenate([np.sqrt(np.diag(e.values[b][1])) for b in e.best.blocks])
    own = np.concatenate([np.sqrt(np.diag(rest.values[k][1])) for k in sorted(rest.values)])
    assert rest.steady
    assert np.abs((rest.point.values - values) / deviation).max() < 1e-4
    assert np.allclose(own, deviation, rtol=1e-4)
    assert np.allclose(rest.noise, e.whitening.noise * e.best.noise, rtol=1e-5)
    assert np.sqrt(rest.squares[0] / rest.count) == pytest.approx(diagnosis.gap.rms_after, rel=1e-7)
    assert rest.count == (~e.outliers).sum()


def test_rivals_are_other_combinations_the_most_probable_first(found):
    e, listed = found.fit.explanation, rivals(found.fit)
    chance = {}
    for combination, probability in zip(e.combinations, e.probabilities, strict=True):
        chance[combination.blocks] = max(chance.get(combination.blocks, 0.0), probability)
    assert e.best.blocks not in listed
    assert listed
    assert [chance[b] for b in listed] == sorted((chance[b] for b in listed), reverse=True)


def test_rows_that_count_by_themselves_can_grow(found):
    assert can_grow(found.fit)
