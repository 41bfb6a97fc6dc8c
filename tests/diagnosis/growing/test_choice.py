"""What an update holds of a diagnosis, and how values belong to effects."""

import numpy as np

from thermal_robot.diagnosis.growing.choice import together


def test_values_fall_to_their_effects(found, grown):
    choice, values = grown.choice, np.concatenate([v for _, v in found.fit.effects])
    assert choice.count == len(values)
    for (effect, own), (known, original) in zip(choice.split(values), found.fit.effects, strict=True):
        assert effect.name == known.name
        assert (own == original).all()


def test_it_holds_no_rows(grown):
    assert all(len(item.columns) == 0 for item in (*grown.choice.blocks, *grown.choice.rivals))


def test_rows_are_weighed_anew_where_noise_is_all_that_remains(found, grown):
    assert found.fit.explanation.discrepancy.form is None
    assert grown.choice.judged


def test_nothing_put_together_is_nothing():
    assert together([]).shape == (0,)
