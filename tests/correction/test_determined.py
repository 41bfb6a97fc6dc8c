"""A model without what is not determined: the rest moves to where a fit without it ends, and the gap stays."""

from dataclasses import replace

import numpy as np
import pytest
from readers import model_of
from simulate import simulate

from thermal_robot import CampaignError, diagnose
from thermal_robot.correction import determined
from thermal_robot.effects import JointOffset
from thermal_robot.prediction import Spread

NOISE = 25e-6


@pytest.fixture(scope="module", params=[None, 3e-5], ids=["position", "pose"])
def bent(rv_m2, request):
    """A model of geometry, most of whose parameters no data can determine, and fresh rows with the truth."""
    campaign, _, (fresh, place) = simulate(rv_m2, ["geometric"], seed=2, fresh=200, turning=request.param)
    return diagnose(campaign, only=["geometric"]).model, campaign, fresh, place


def off(model, fresh, place):
    """Rms per axis of the distance between what a model predicts and the truth."""
    return np.sqrt(((model.predict(fresh)[0] - place) ** 2).mean())


def values(model):
    return np.concatenate([values for _, values in model.effects])


def test_what_is_left_out_costs_less_than_the_noise(bent):
    model, _, fresh, place = bent
    kept, gone = determined(model, 2.0)
    assert 5 < len(gone) < len(values(model)) - 5
    assert (values(kept) == 0.0).sum() == len(gone)
    assert off(kept, fresh, place) < off(model, fresh, place) + 0.3 * NOISE
    # to take them out one by one without a word to the others costs ten times more
    std = np.sqrt(model.spread.covariance.diagonal()[-len(values(model)) :])
    alone = np.where(np.abs(values(model)) < 2.0 * std, 0.0, values(model))
    naive = replace(model, effects=((model.effects[0][0], alone),))
    assert off(naive, fresh, place) > off(model, fresh, place) + NOISE


def test_all_that_is_left_is_significant_and_nothing_else_is_said(bent):
    model, *_ = bent
    for sigma in (0.0, 1.0, 2.0, 5.0):
        kept, gone = determined(model, sigma)
        left = values(kept) != 0.0
        std = np.sqrt(kept.spread.covariance.diagonal()[-len(left) :])
        assert (np.abs(values(kept)[left]) >= sigma * std[left] * (1 - 1e-9)).all()
        assert not std[~left].any()
        assert len(gone) == (~left).sum()
        assert np.linalg.eigvalsh(kept.spread.covariance).min() > -1e-15
    assert not determined(model, 0.0)[1]
    assert not values(determined(model, 1e9)[0]).any()


def test_of_two_that_only_their_sum_is_known_of_one_stays(rv_m2):
    """Two numbers of 0.5 ± 1 each, whose sum is 1 ± 0.1: neither is significant, both together are."""
    covariance = np.zeros((5, 5))
    covariance[:2, :2] = [[1.0, -0.995], [-0.995, 1.0]]
    covariance[2, 2], covariance[3, 3], covariance[4, 4] = 1.0, 1.0, 1e-4
    model = model_of(rv_m2, (JointOffset(), [0.5, 0.5, 0.3, 0.0, 0.2]), base_known=True, tool_known=True)
    model = replace(model, spread=Spread(covariance, np.zeros(3), np.zeros(3)))
    kept, gone = determined(model, 2.0)
    offsets = values(kept)
    assert sorted(np.flatnonzero(offsets[:2] != 0.0).tolist()) in ([0], [1])
    assert offsets[:2].sum() == pytest.approx(1.0, abs=0.01)
    np.testing.assert_array_equal(offsets[2:], [0.0, 0.0, 0.2])
    assert {told.value for told in gone} == {0.5, 0.3, 0.0}


def test_what_cannot_be_judged_is_refused(rv_m2):
    bare = model_of(rv_m2, (JointOffset(), np.ones(5)))
    with pytest.raises(CampaignError, match="how sure"):
        determined(bare, 2.0)
    for sigma in (-1.0, np.nan, np.inf):
        with pytest.raises(CampaignError, match="standard deviations"):
            determined(bare, sigma)
