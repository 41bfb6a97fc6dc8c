"""What a CSV of ROS topics has, by its header; the whole way is in test_rosbag."""

import numpy as np
import pytest

from thermal_robot.campaign.importers.rosbag import read_streams
from thermal_robot.errors import CampaignError

JOINTS = ("a", "b")


def read(tmp_path, text):
    (tmp_path / "f.csv").write_text(text)
    return read_streams(tmp_path / "f.csv", JOINTS)


def test_stamps_count_for_more_than_the_time_of_coming(tmp_path):
    text = "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1\n"
    text += "9000000000,1000000000,b,a,0.5,0.25\n9900000000,2000000000,b,a,0.6,0.35\n"
    joints, target = read(tmp_path, text)
    assert target is None
    np.testing.assert_allclose(joints.time, [1.0, 2.0])
    np.testing.assert_allclose(joints.values, [[0.25, 0.5], [0.35, 0.6]])


def test_orientations_are_put_scalar_first(tmp_path):
    parts = [f"field.transform.rotation.{axis}" for axis in "xyzw"]
    places = [f"field.transform.translation.{axis}" for axis in "xyz"]
    text = ",".join(["%time", *parts, *places]) + "\n1000000000,.1,.2,.3,.9,1,2,3\n2000000000,.1,.2,.3,.9,4,5,6\n"
    _, target = read(tmp_path, text)
    assert target.names == ("x", "y", "z", "qw", "qx", "qy", "qz")
    np.testing.assert_allclose(target.values[0], [1, 2, 3, 0.9, 0.1, 0.2, 0.3])


def test_lines_without_a_header(tmp_path):
    _, target = read(tmp_path, "1,500000000,map,1,2,3,.1,.2,.3,.9\n2,0,map,4,5,6,.1,.2,.3,.9\n")
    np.testing.assert_allclose(target.time, [1.5, 2.0])
    np.testing.assert_allclose(target.values[1], [4, 5, 6, 0.9, 0.1, 0.2, 0.3])
    joints, _ = read(tmp_path, "1,0,,a,hand,b,.1,.9,.2,0,0,0\n2,0,,a,hand,b,.3,.9,.4,0,0,0\n")
    np.testing.assert_allclose(joints.values, [[0.1, 0.2], [0.3, 0.4]])
    with pytest.raises(CampaignError, match="column 'a': a joint of the chain is not among the names; found 'c', 'b'"):
        read(tmp_path, "1,0,,c,b,.1,.2\n2,0,,c,b,.3,.4\n")
    with pytest.raises(CampaignError, match="neither joint states nor poses are recognised"):
        read(tmp_path, "1,0,map,1,2\n2,0,map,1,2\n")


def test_a_comma_at_the_end_of_a_line_is_no_field(tmp_path):
    _, target = read(tmp_path, "1,0,map,1,2,3,\n2,0,map,4,5,6,\n")
    np.testing.assert_allclose(target.values, [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize("suffix", ["", "/position"])
@pytest.mark.parametrize("behind", ["", ",0,0,nan,nan", ",nan,nan,nan,nan", ",0,0,,", ",0,0,inf,inf"])
@pytest.mark.parametrize("frame", ["", "base"])
def test_what_stands_behind_the_positions_does_not_shift_them(tmp_path, frame, behind, suffix):
    lines = [f"{k},0,{frame},b{suffix},a{suffix},{k / 10},{k / 5}{behind}" for k in (1, 2, 3)]
    joints, target = read(tmp_path, "\n".join(lines) + "\n")
    assert target is None
    np.testing.assert_allclose(joints.values, [[0.2, 0.1], [0.4, 0.2], [0.6, 0.3]])
