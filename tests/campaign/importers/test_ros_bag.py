"""Bags without the library that reads them; what they hold is read in test_rosbag."""

import sys

import pytest

from thermal_robot.campaign.importers.rosbag import read_bag
from thermal_robot.errors import CampaignError


def test_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(CampaignError, match=r'bags need rosbags, .* expected pip install "thermal-robot\[ros\]"'):
        read_bag(tmp_path / "a.bag", ("a",), None, None)


def test_a_topic_that_is_not_there(tmp_path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        kind, store = "sensor_msgs/msg/JointState", get_typestore(Stores.ROS2_HUMBLE)
        writer.add_connection("/joint_states", kind, typestore=store)
    with pytest.raises(CampaignError, match="in topic '/arm'; found '/joint_states', expected its topics"):
        read_bag(tmp_path / "bag", ("a",), "/arm", None)
    assert read_bag(tmp_path / "bag", ("a",), None, None) == (None, None)
