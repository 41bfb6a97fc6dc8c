"""Groups of rows: repeats of a pose, neighbours in joint space, blocks in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.inference import settings

Labels = NDArray[np.int64]


def near_repeats(campaign: Campaign) -> Labels:
    """Cluster label (N,) of commands that lie within :data:`settings.NEAR` of each other.

    Samples along a path chain into one cluster; the distance is then halved until no cluster holds more than a tenth
    of the rows, so that only closer repeats count. Rows with the same ``pose`` label always belong together.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    samples, radius = campaign.samples, settings.NEAR
    tree = cKDTree(campaign.q)
    while True:
        pairs = tree.query_pairs(radius, output_type="ndarray")
        graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(samples, samples))
        count, labels = connected_components(graph, directed=False)
        if radius < settings.CLOSEST or np.bincount(labels, minlength=count).max() <= max(
            settings.LARGEST_CLUSTER * samples, 2
        ):
            break
        radius /= 2
    stated = campaign.pose_labels
    if stated is not None and np.any(stated != ""):
        _, named = np.unique(stated, return_inverse=True)
        key = np.where(stated != "", named + count, labels)
        joined = coo_matrix((np.ones(samples), (labels, key)), shape=(2 * count + samples,) * 2)
        _, merged = connected_components(joined, directed=False)
        labels = merged[labels]
    return np.unique(labels, return_inverse=True)[1].astype(np.int64)


def in_order(campaign: Campaign) -> Labels:
    """Row numbers (N,) in the order of measurement: by ``time`` or ``order`` where recorded, else as in the file."""
    clock = campaign.clock
    return np.arange(campaign.samples) if clock is None else np.argsort(clock, kind="stable")


def consecutive_outliers(campaign: Campaign, aside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Outliers (N,) in runs of three or more consecutive rows: a change, not gross errors."""
    order = in_order(campaign)
    own = aside[order]
    run = np.cumsum(np.diff(own, prepend=False))  # odd within runs
    result = np.zeros_like(own)
    result[order] = own & (np.bincount(run, minlength=1)[run] >= settings.RUN)
    return result


def neighbourhoods(campaign: Campaign, count: int) -> Labels:
    """Label (N,) of one of about ``count`` boxes of joint space with equally many rows (median splits)."""
    labels = np.zeros(campaign.samples, dtype=np.int64)
    boxes = [np.arange(campaign.samples)]
    while len(boxes) < count:
        boxes.sort(key=len)
        box = boxes.pop()
        if len(box) < 2:
            boxes.append(box)
            break
        widest = int(np.argmax(np.ptp(campaign.q[box], axis=0)))
        order = box[np.argsort(campaign.q[box, widest], kind="stable")]
        boxes += [order[: len(box) // 2], order[len(box) // 2 :]]
    for label, box in enumerate(boxes):
        labels[box] = label
    return labels


def blocks(campaign: Campaign) -> Labels:
    """Label (N,), 0..B−1, of blocks of consecutive measurements, ``settings.BLOCKS`` at most: folds, jackknife groups.

    Near-repeats stay together.
    """
    cluster = near_repeats(campaign)
    rank = np.empty(campaign.samples)
    rank[in_order(campaign)] = np.arange(campaign.samples)
    sizes = np.bincount(cluster)
    # a cluster stands where its middle measurement does
    middle = np.bincount(cluster, rank) / sizes
    order = np.argsort(middle, kind="stable")
    ahead = np.empty(len(order))
    ahead[order] = np.cumsum(sizes[order]) - sizes[order]
    count = min(settings.BLOCKS, len(order))
    block = np.minimum(ahead * count // campaign.samples, count - 1).astype(np.int64)[cluster]
    return np.unique(block, return_inverse=True)[1].astype(np.int64)


STAND = "stand"  # Label of what stays in one place while the robot is brought to it


def held_out_groups(campaign: Campaign) -> tuple[Labels, str]:
    """Cross-validation folds (N,), and their scheme: an instrument's stands, or else blocks of consecutive rows.

    Stands are taken where the campaign holds no positions and has at least :data:`settings.FEWEST_STANDS` of them.
    """
    stands = campaign.labels.get(STAND)
    if stands is not None and campaign.position is None:
        number = np.unique(stands, return_inverse=True)[1].ravel()
        if number.max() + 1 >= settings.FEWEST_STANDS:
            return number.astype(np.int64), STAND
    return blocks(campaign), "blocked"


def each(labels: Labels) -> list[NDArray[np.bool_]]:
    """Mask (N,) of the rows of each label, in order."""
    return [labels == label for label in np.unique(labels)]


def repeated_poses(campaign: Campaign) -> NDArray[np.int64]:
    """Return number (N,) of each row's commanded pose: by its ``pose`` label, or without that column by its command.

    A row whose label is empty stands alone.
    """
    label = campaign.pose_labels
    if label is None:
        same = np.round(campaign.q / settings.SAME_COMMAND).astype(np.int64)
        return np.asarray(np.unique(same, axis=0, return_inverse=True)[1]).ravel()
    number = np.unique(label, return_inverse=True)[1].ravel()
    empty = label == ""
    number[empty] = number.max() + 1 + np.arange(int(empty.sum()))
    return np.asarray(number)
