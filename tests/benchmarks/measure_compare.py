"""Measure how often a comparison is right: changes found, false changes, false names lost.

    python tests/benchmarks/measure_compare.py --robots 50 --triples 50

Campaigns are those of ``tr.simulate``; seeds count up from 0. Not a part of the test suite: it takes minutes to hours.
"""

import argparse
import time

import numpy as np

import thermal_robot as tr

ARMS = (("builtin:rv_m2", "tool0"), ("example-robot-data:ur5", "tool0"))
ROWS, NOISE = 60, 3e-5
TIMES = 4.0
"""Deviations of the difference, as the comparison of two campaigns without a change states it, by which one changes."""
SIZES = {"joint_offset": 1e-3, "joint_gain": 5e-4, "joint_compliance": 2e-6}
"""Effects at work in every joint of the robots that are compared, and their scale."""
CAUSES = (
    "joint_gain",
    "transmission_error",
    "joint_compliance",
    "backlash",
    "link_compliance",
    "drift",
    "base_compliance",
)
"""Effects that are at work and withheld, in turn: what nobody wrote down."""
UNLIKE = (0.4, 1.0, 2.5)
"""Sizes of an unlisted cause in three campaigns, in an order that is drawn."""


def measured(robot, effects, seed):
    """Return a campaign in which base and target are unknown; every seed has poses and noise of its own."""
    return tr.simulate(
        robot, effects, rows=ROWS, noise=NOISE, base=np.eye(4), tool=np.eye(4), seed=seed, conditions={"payload": 3.0}
    )


def faults(robot, rng):
    """Return offsets in all joints, and in every second robot a second effect, by effect and joint."""
    effects = {"joint_offset": rng.normal(0.0, SIZES["joint_offset"], robot.n)}
    second = rng.choice(["", "joint_gain"])
    if second:
        effects[second] = rng.normal(0.0, SIZES[second], robot.n)
    return effects


def pair(seed):
    """Compare a robot with itself, and with itself after one parameter changed; return what was said of both."""
    arm, rng = ARMS[seed % len(ARMS)], np.random.default_rng([17, seed])
    robot = tr.load_robot(*arm)
    effects = faults(robot, rng)
    first, again = (tr.diagnose(measured(robot, effects, 10 * seed + k)) for k in range(2))
    same = tr.compare(first, again, names=["before", "after"])
    told = [
        (effect.name, p.place, p.std)
        for effect in same.effects
        for p in effect.parameters
        if p.std is not None and effect.name in effects
    ]
    if not told:
        return same, None, None
    name, place, std = told[rng.integers(len(told))]
    changed = {key: values.copy() for key, values in effects.items()}
    changed[name][robot.joint_names.index(place)] += rng.choice([-1.0, 1.0]) * TIMES * std
    later = tr.diagnose(measured(robot, changed, 10 * seed + 2))
    return same, tr.compare(first, later, names=["before", "after"]), (name, place)


def triple(seed):
    """Compare three campaigns with an unlisted cause of another size in each; return names that are false, and lost."""
    arm, rng = ARMS[seed % len(ARMS)], np.random.default_rng([18, seed])
    robot, cause = tr.load_robot(*arm), CAUSES[seed % len(CAUSES)]
    offsets = rng.normal(0.0, SIZES["joint_offset"], robot.n)
    poor = tr.simulate(robot, rows=ROWS, conditions={"payload": 3.0})
    sizes = _sizes(robot, cause, poor, rng)
    found = []
    for k, factor in enumerate(rng.permutation(UNLIKE)):
        campaign = measured(robot, {"joint_offset": offsets, cause: factor * sizes}, 10 * seed + k)
        found.append(tr.diagnose(campaign, without=cause))
    compared = tr.compare(*found, names=["first", "second", "third"])
    false = [
        (effect.name, len(effect.named), effect.name in compared.lost, effect.reason)
        for effect in compared.effects
        if effect.named
        and effect.name not in ("joint_offset", "geometric")
        and not effect.name.startswith("discovered.")
    ]
    return cause, false, [diagnosis.verdict for diagnosis in found], compared


def _sizes(robot, cause, campaign, rng):
    """Return values of a cause in all its parameters, three times the expected size, so that it is seen."""
    from thermal_robot.effects import library
    from thermal_robot.observations import observe

    parameters = library()[cause].parameters(observe(campaign))
    drawn = rng.normal(0.0, 1.0, len(parameters))
    drawn = np.where([p.positive for p in parameters], np.abs(drawn), drawn)
    return 2.0 * drawn * np.array([p.size for p in parameters])


def rate(what, count, among):
    """Print a rate with its counts and Wilson's 95 % interval."""
    if not among:
        print(f"{what}: 0 of 0")
        return
    p, z2 = count / among, 1.96**2
    middle, half = (p + z2 / (2 * among)), 1.96 * np.sqrt(p * (1 - p) / among + z2 / (4 * among**2))
    low, high = ((middle + sign * half) / (1 + z2 / among) for sign in (-1, 1))
    print(f"{what}: {count} of {among} = {p:.1%} ({low:.1%} to {high:.1%})", flush=True)


def pairs(first, count):
    """Measure changes."""
    found = alone = false = others = among = compared = places = 0
    for seed in range(first, first + count):
        begin = time.perf_counter()
        same, later, truth = pair(seed)
        compared, false, places = compared + 1, false + bool(same.changes), places + same.looked_at
        said = ""
        if later is not None:
            among += 1
            right = [c for c in later.changes if (c.effect, c.place) == truth]
            other = [c for c in later.changes if (c.effect, c.place) != truth]
            found, alone, others = found + bool(right), alone + (bool(right) and not other), others + bool(other)
            said = f"{truth} {'found' if right else 'MISSED'} {[(c.effect, c.place) for c in other] or ''}"
        wrong = [(c.effect, c.place, c.parameters) for c in same.changes]
        print(f"  seed {seed}: {said} {wrong or ''} {time.perf_counter() - begin:.0f} s", flush=True)
    rate("changed parameter found", found, among)
    rate("found, and nothing else", alone, among)
    rate("another change beside it", others, among)
    rate("no change, and one is told", false, compared)
    print(f"places compared: {places} in {compared} pairs")


def triples(first, count):
    """Measure names."""
    lost = {1: 0, 2: 0, 3: 0}
    among = {1: 0, 2: 0, 3: 0}
    for seed in range(first, first + count):
        begin = time.perf_counter()
        cause, false, verdicts, compared = triple(seed)
        for _, named, gone, _ in false:
            among[named], lost[named] = among[named] + 1, lost[named] + gone
        kept = compared.effect("joint_offset").status
        print(
            f"  seed {seed}: {cause} {false} {verdicts} offsets {kept} {time.perf_counter() - begin:.0f} s", flush=True
        )
    for named in among:
        rate(f"false name in {named} of three campaigns, lost", lost[named], among[named])


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=0)
    parser.add_argument("--triples", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    if options.robots:
        pairs(options.first, options.robots)
    if options.triples:
        triples(options.first, options.triples)
