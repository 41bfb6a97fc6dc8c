"""Campaigns with known answers, made with the exact perturbed model, for the demo and the tests.

It shares the effects' formulas with the program, so it tests estimation and diagnosis, not the physics.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermal_robot.campaign import Campaign, Units, write_campaign
from thermal_robot.effects import library
from thermal_robot.effects.apply import displacement
from thermal_robot.kinematics import exp3, quaternion_to_rotation, rotation_to_quaternion, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot


def random_motion(rng, reach):
    """A rigid motion that a tracker's place may be: any direction, a few metres away."""
    pose = np.eye(4)
    pose[:3, :3] = quaternion_to_rotation(rng.normal(size=(1, 4)))[0]
    pose[:3, 3] = rng.uniform(-reach, reach, 3)
    return pose


def commands(robot, samples, rng, share=0.75):
    """Joint positions within a share of the limits (±2.4 rad where wider), the nearest third left out."""
    lower, upper = np.maximum(robot.lower, -2.4), np.minimum(robot.upper, 2.4)
    middle, half = (lower + upper) / 2, share * (upper - lower) / 2
    drawn = rng.uniform(middle - half, middle + half, (4 * samples + 50, robot.n))
    place = tool_poses(robot, drawn)[:, :3, 3]
    reach = np.linalg.norm(place, axis=1)
    return drawn[reach > np.quantile(reach, 0.3)][:samples]


def conditions(robot, q, rng, heaviest):
    """Time over two hours, a temperature that rises and swings, payload in three steps, directions of approach."""
    samples = len(q)
    time = np.sort(rng.uniform(0, 7200.0, samples))
    swing = rng.uniform(2, 8) * np.sin(time / 7200.0 * rng.uniform(1.5, 9) + rng.uniform(0, 6))
    temperature = 22.0 + swing + rng.uniform(-2, 5) * time / 7200.0
    covariates = {
        "time": time,
        "temperature": temperature,
        "payload": rng.choice([0.0, heaviest / 2, heaviest], samples),
    }
    for joint in robot.joint_names:
        covariates[f"approach.{joint}"] = rng.choice([-1.0, 1.0], samples)
    return covariates


def further_conditions(robot, q, rng, moving, links):
    """Joints that are measured in passing, at several speeds; a sensor on each link, warmed by its motor."""
    samples = len(q)
    covariates = {}
    if moving:
        speed = rng.choice([0.1, 0.3, 1.0], samples)
        for joint in robot.joint_names:
            covariates[f"velocity.{joint}"] = speed * rng.uniform(-0.8, 0.8, samples)
            covariates[f"acceleration.{joint}"] = speed * rng.normal(0.0, 1.5, samples)
    if links:
        run = np.arange(samples) / samples
        for link in dict.fromkeys(segment.parent_link for segment in robot.segments):
            warm_up = rng.uniform(2.0, 10.0) * -np.expm1(-run / rng.uniform(0.1, 0.5))
            swing = rng.uniform(0.5, 3.0) * np.sin(run * rng.uniform(2, 12) + rng.uniform(0, 6))
            covariates[f"temperature.{link}"] = 21.0 + warm_up + swing
    return covariates


NEW = ("joint_ripple", "tracking_lag", "link_compliance", "thermal_bending", "base_compliance")
"""Effects that are at work in the background only where they are asked for: the campaigns of old seeds stay."""


def draw_effect(name, nominal, rng, places=None, variant=0):
    """An effect with random parameters of its expected size; few joints at fault where that is how it comes."""
    variants = library()[name].variants(nominal)
    effect = variants[rng.integers(len(variants)) if name == "drift" else variant]
    parameters = effect.parameters(nominal)
    values = np.array([p.size for p in parameters]) * rng.normal(size=len(parameters))
    if name in (
        "thermal_elongation",
        "joint_compliance",
        "backlash",
        "tracking_lag",
        "link_compliance",
        "base_compliance",
    ):
        values = np.abs(values)
    if name == "thermal_elongation":
        values = np.array([p.size for p in parameters]) * rng.uniform(0.6, 1.6, len(parameters))
    if name in ("joint_offset", "joint_gain", "transmission_error", "backlash", "tracking_lag"):
        sites = list(dict.fromkeys(p.place for p in parameters))
        sites = sites[1:-1] if name == "joint_offset" else sites
        faulty = set(places or rng.choice(sites, rng.integers(1, 4), replace=False))
        values = np.where([p.place in faulty for p in parameters], values, 0.0)
    return effect, values


def remaining(campaign, nominal, effect, values):
    """Rms distance that an effect leaves after the best rigid alignment of base and target, m."""
    from thermal_robot.inference.columns import block, frame_columns

    item = block(nominal, effect)
    moved = (item.columns @ values)[:, :3].ravel()
    frames = frame_columns(nominal)[0][:, :3].reshape(len(moved), -1)
    moved = moved - frames @ np.linalg.lstsq(frames / 1.0, moved, rcond=1e-10)[0]
    return float(np.sqrt((moved**2).sum() / campaign.samples))


def simulate(
    robot,
    effects=(),
    *,
    samples=120,
    seed=0,
    noise=25e-6,
    turning=None,
    ratio=(2.0, 6.0),
    outliers=0.0,
    heavy=False,
    background=0.0,
    heaviest=3.0,
    places=None,
    fresh=0,
    moving=False,
    links=False,
    variant=0,
):
    """Simulate a campaign.

    ``moving`` and ``links`` add columns of what joints do in passing, and of each link's temperature; ``variant``
    chooses among the settings of an effect.

    Returns the campaign, its truth (a dict), and ``fresh`` further samples as a pair of a campaign without measurements
    and where the target really is, in the measurement frame (or None).
    """
    rng = np.random.default_rng(seed)
    total = samples + fresh
    q = commands(robot, total, rng)
    q = q[rng.permutation(len(q))]
    frames = Frames(random_motion(rng, 2.0), random_motion(rng, 0.12))
    campaign = Campaign(
        "simulated",
        robot,
        q,
        np.zeros((total, 3)),
        None if turning is None else np.tile([1.0, 0, 0, 0], (total, 1)),
        covariates={
            **conditions(robot, q, rng, heaviest),
            # a generator of its own: what the first one draws from here on stays as it was
            **further_conditions(robot, q, np.random.default_rng([seed, 1]), moving, links),
        },
        target=frames.tool[:3, 3] + rng.uniform(-0.01, 0.01, 3),
        noise_position=noise,
        noise_orientation=turning,
        payload_com=np.array([0.0, 0.0, 0.05]),
        units=Units("rad", "mm"),
    )
    nominal = observe(campaign, frames)
    chosen, truth = [], {"effects": list(effects), "parts": {}, "noise": noise, "seed": seed}
    old = {n: e for n, e in library().items() if n not in NEW}
    others = [n for n, e in old.items() if background and n not in effects and not e.missing(nominal)]
    for name in [*effects, *others]:
        effect, values = draw_effect(name, nominal, rng, *((places, variant) if name in effects else ()))
        wanted = noise * np.sqrt(3.0) * (rng.uniform(*ratio) if name in effects else background)
        left = remaining(campaign, nominal, effect, values)
        values = values * (wanted / left)
        chosen.append((effect, values))
        parameters = effect.parameters(nominal)
        truth["parts"][name] = {
            "rms": wanted,
            "background": name not in effects,
            "values": {p.name: float(v) for p, v in zip(parameters, values, strict=True) if v},
        }
    moved, instrument = displacement(nominal, chosen)
    real = observe(campaign, frames, displacement=moved)
    position = real.predicted_position + (0 if instrument is None else instrument)
    rotation = frames.base[:3, :3] @ real.rotation
    unit = rng.standard_t(4, (total, 3)) / np.sqrt(2.0) if heavy else rng.normal(size=(total, 3))
    measured = position + noise * unit
    mine = np.sort(rng.permutation(total)[:samples])
    spoilt = mine[rng.uniform(size=samples) < outliers]
    measured[spoilt] += rng.normal(size=(len(spoilt), 3)) * noise * rng.uniform(20, 200, (len(spoilt), 1))
    orientation = None
    if turning is not None:
        orientation = rotation_to_quaternion(exp3(turning * rng.normal(size=(total, 3))) @ rotation)
    truth["outliers"] = (np.searchsorted(mine, spoilt) + 2).tolist()
    whole = replace(campaign, position=measured, orientation=orientation)
    data = replace(whole.take(mine), rows=np.arange(2, samples + 2))
    if not fresh:
        return data, truth, None
    others = np.setdiff1d(np.arange(total), mine)
    return data, truth, (replace(whole.take(others), position=None, orientation=None), position[others])


DEMO_SEED = 2018


def demo():
    """The demo: an RV-M2 whose links grow with the hall's temperature, and whose elbow has play."""
    robot = load_robot("builtin:rv_m2", "tool0")
    return simulate(
        robot,
        ["thermal_elongation", "backlash"],
        samples=120,
        seed=DEMO_SEED,
        noise=12e-6,
        ratio=(1.5, 2.5),
        outliers=0.02,
        heaviest=2.0,
        places=["joint_3"],
    )


def main():
    """Write the demo's campaign with its truth."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("directory", type=Path)
    directory = parser.parse_args().directory
    campaign, truth, _ = demo()
    write_campaign(campaign, directory)
    (directory / "truth.json").write_text(json.dumps(truth, indent=2) + "\n")


if __name__ == "__main__":
    main()
