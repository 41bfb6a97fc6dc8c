"""Segments as beams: which bend, and about what."""

import numpy as np
import pytest

from thermal_robot.effects.beam import SHORTEST, beams, cross_axes


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward", "tiago"], indirect=True)
def test_the_axes_across_a_segment_are_right_angled_to_it_and_to_each_other(arm):
    for s in beams(arm):
        basis = np.vstack([cross_axes(arm, s), arm.segments[s].direction])
        np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "awkward"], indirect=True)
def test_the_first_axis_lies_across_an_axis_of_the_parent_links_frame(arm):
    for s in beams(arm):
        segment = arm.segments[s]
        first = arm.chain.rotations[segment.index] @ cross_axes(arm, s)[0]
        along = arm.chain.rotations[segment.index] @ segment.direction
        # that axis of the frame which lies most across the segment is in the plane of the other two
        most_across = int(np.argmin(np.abs(along)))
        assert abs(first[most_across]) < 1e-12


def test_only_segments_with_a_length_bend(awkward):
    bent = beams(awkward)
    lengths = np.array([segment.length for segment in awkward.segments])
    assert bent
    assert (lengths[list(bent)] > SHORTEST).all()
    assert (np.delete(lengths, bent) <= SHORTEST).all()
