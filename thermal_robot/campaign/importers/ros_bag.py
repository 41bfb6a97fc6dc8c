"""Bags of ROS 1 and ROS 2: joint states, and poses or points of the target, by the library rosbags.

Source: ternaris.gitlab.io/rosbags, ``rosbags.highlevel.AnyReader``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.campaign import names
from thermal_robot.campaign.headings import joint_columns
from thermal_robot.campaign.importers.standstill import Stream, stream
from thermal_robot.campaign.names import listed
from thermal_robot.errors import CampaignError

ENDINGS = (".bag", ".mcap", ".db3")
_JOINTS = ("sensor_msgs/msg/JointState",)
_TARGETS = {
    "geometry_msgs/msg/PoseStamped": "pose",
    "geometry_msgs/msg/TransformStamped": "transform",
    "geometry_msgs/msg/PointStamped": "point",
}
"""Types of messages with a place, and the field that holds it."""
_NANOSECOND = 1e-9
WITH_ROSBAGS = 'pip install "thermal-robot[ros]"'


def read_bag(
    path: Path, joints: Sequence[str], joint_topic: str | None, target_topic: str | None
) -> tuple[Stream | None, Stream | None]:
    """Return what a bag has of the joints and of the target; ``None`` where no topic has messages of that kind.

    Parameters
    ----------
    path
        File of ROS 1, or file or folder of ROS 2.
    joints
        Of the chain.
    joint_topic, target_topic
        Which topics; ``None`` where one alone has messages of that kind.

    Raises
    ------
    CampaignError
        A bag that cannot be read, several topics to choose from, a joint that is not recorded, or rosbags that is not
        installed.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise CampaignError(str(path), "bags need rosbags, which is not installed", expected=WITH_ROSBAGS) from error
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            found = []
            for types, topic, key in ((_JOINTS, joint_topic, "joints"), (tuple(_TARGETS), target_topic, "pose")):
                chosen = _connections(str(path), reader, types, topic, key)
                messages = [
                    (stamp, reader.deserialize(raw, connection.msgtype), connection.msgtype)
                    for connection, stamp, raw in (reader.messages(connections=chosen) if chosen else ())
                ]
                found.append(messages)
    except AnyReaderError as error:
        raise CampaignError(
            str(path), f"cannot be read as a bag ({error})", expected="a bag of ROS 1 or ROS 2"
        ) from error
    return _joint_stream(str(path), found[0], joints), _target_stream(str(path), found[1])


def _connections(file: str, reader: Any, types: Sequence[str], topic: str | None, key: str) -> list[Any]:
    """Return the connections of one topic."""
    fitting = [c for c in reader.connections if c.msgtype in types]
    topics = sorted({c.topic for c in fitting})
    if topic is None and len(topics) > 1:
        raise CampaignError(
            file,
            f"several topics have messages of {' or '.join(types)}",
            found=listed(topics),
            expected=f"[recording] {key} in the mapping",
        )
    if topic is not None and topic not in topics:
        raise CampaignError(
            file, f"no messages of {' or '.join(types)} in topic {topic!r}", found=listed(topics), expected="its topics"
        )
    return [c for c in fitting if topic in (None, c.topic)]


def _instant(stamp: int, message: Any) -> float:
    """Return when a message was measured, s; when it was recorded where it does not say."""
    header = message.header.stamp
    return header.sec + header.nanosec * _NANOSECOND if header.sec or header.nanosec else stamp * _NANOSECOND


def _joint_stream(file: str, messages: Sequence[Any], joints: Sequence[str]) -> Stream | None:
    if not messages:
        return None
    times, rows = [], []
    for stamp, message, _ in messages:
        where = joint_columns(message.name, joints)
        if len(where) == len(joints):  # a hand may speak in messages of its own
            times.append(_instant(stamp, message))
            rows.append([message.position[message.name.index(where[joint])] for joint in joints])
    if not rows:
        recorded = sorted({name for _, message, _ in messages for name in message.name})
        raise CampaignError(
            file, "no message has all joints of the chain", found=listed(recorded), expected=listed(joints)
        )
    return stream(file, np.array(times), np.array(rows, dtype=float), joints)


def _target_stream(file: str, messages: Sequence[Any]) -> Stream | None:
    if not messages:
        return None
    times, rows = [], []
    for stamp, message, kind in messages:
        held = getattr(message, _TARGETS[kind])
        place = next((getattr(held, name) for name in ("position", "translation") if hasattr(held, name)), held)
        turn = next((getattr(held, name) for name in ("orientation", "rotation") if hasattr(held, name)), None)
        parts = [] if turn is None else [turn.w, turn.x, turn.y, turn.z]
        times.append(_instant(stamp, message))
        rows.append([place.x, place.y, place.z, *parts])
    whole = names.MEASURED if len(rows[0]) == len(names.MEASURED) else names.POSITION
    return stream(file, np.array(times), np.array(rows, dtype=float), whole)
