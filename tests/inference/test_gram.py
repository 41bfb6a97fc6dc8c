"""A problem of some blocks alone is what it would be if there were no others."""

import numpy as np
import pytest
from inference.problems import small_problem

from thermal_robot.inference.problem import Linear, gram
from thermal_robot.inference.search import Search


@pytest.mark.parametrize("blocks", [(), (1,), (0, 2), (2, 0)], ids=str)
def test_some_blocks_are_a_problem_of_their_own(blocks):
    for seed in range(3):
        linear, whitening = small_problem(seed, present=(0, 2))
        few = gram(linear, whitening).some(blocks)
        alone = gram(Linear(linear.gap, linear.frames, tuple(linear.blocks[b] for b in blocks)), whitening)
        assert [b.shape for b in few.bases] == [b.shape for b in alone.bases]
        assert few.slices == alone.slices
        assert (few.equations, few.total) == (alone.equations, pytest.approx(alone.total, rel=1e-12))
        # directions of a block may be turned; what they say may not
        np.testing.assert_allclose(np.linalg.eigvalsh(few.matrix), np.linalg.eigvalsh(alone.matrix), rtol=1e-9)
        every = tuple(range(len(blocks)))
        own, theirs = (Search(g, [0.0] * len(blocks)).evaluate(every) for g in (few, alone))
        assert own.log_evidence == pytest.approx(theirs.log_evidence, rel=1e-9)
        assert own.noise == pytest.approx(theirs.noise, rel=1e-9)
