"""Tables of docs/data.md and correction.md: a model and its robot files in other campaigns of the same robot.

Start it as a script with the model of ``thermal-robot diagnose --model`` and the folders of campaigns. Base and tool
are registered anew in all rows of each campaign, by least squares of positions; files are written and read again.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import thermal_robot as tr
from thermal_robot.blind.real import seen_in_position
from thermal_robot.correction import CorrectedModel, calibrated, calibrated_urdf, zero_offsets
from thermal_robot.correction.holding import at_poses
from thermal_robot.effects.apply import displacement
from thermal_robot.inference.algebra import equations_of, orthonormal, rms, without
from thermal_robot.inference.columns import frame_columns
from thermal_robot.observations import observe


def main():
    """Print the gap of each campaign with the model, and the shrinkage by each robot file: said of it, and real."""
    model, worst = CorrectedModel.load(sys.argv[1]), []
    print(model)
    for folder in map(Path, sys.argv[2:]):
        campaign = tr.read_campaign(folder / "campaign.toml")
        seen = seen_in_position(campaign)
        moved = observe(campaign, seen.frames, displacement=displacement(seen, model.effects)[0]).position
        left = (seen.gap[:, :3] - moved + seen.position).ravel()
        basis = orthonormal(equations_of(frame_columns(seen)[0]))
        before = rms(seen.gap[:, :3])
        print(
            f"{folder.name}: {1e3 * before:.3f} mm, with the model {1e3 * rms(without(left, basis).reshape(-1, 3)):.3f}"
        )
        for here, own in zip(at_poses(model, campaign), model.files, strict=True):
            if own.holds == "ticks":
                continue
            real = 1.0 - (rms(seen_in_position(with_file(model, campaign, own)).gap[:, :3]) / before) ** 2
            shares = [100.0 * share for share in (own.shrinkage, here.shrinkage, real)]
            worst.append([shares[0] - shares[2], shares[1] - shares[2]])
            how = "alone" if own.alone else f"beyond {own.min_sigma or 0:g} sigma"
            print(
                "    {}, {}: held out {:.0f} %, at these poses {:.0f} %, real {:.0f} %".format(own.holds, how, *shares)
            )
    off = np.abs(worst)
    print("off by 5 points at most: held out {}, at the poses {}".format(*(off <= 5).sum(axis=0)), "of", len(off))
    print("off by, median: held out {:.1f}, at the poses {:.1f} points".format(*np.median(off, axis=0)))


def with_file(model, campaign, gap):
    """The campaign with the robot, or the zeros, of a file that was written for the model."""
    how = {"min_sigma": gap.min_sigma, "alone": bool(gap.alone)}
    if gap.holds == "placements":
        return replace(campaign, robot=tr.load_robot(calibrated_urdf(calibrated(model, **how)), model.robot.tool_frame))
    zeros = zero_offsets(model, **how)["add_to_command"].to_numpy()
    return replace(campaign, q=campaign.q - zeros, travelled={})


if __name__ == "__main__":
    main()
