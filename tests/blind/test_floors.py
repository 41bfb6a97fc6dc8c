"""The floors of the drawn trial let a good program pass, and a poor one not."""

import math

import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from benchmarks.bench_blind import COUNTS, POOR, TARGETS, floor, judged

from thermal_robot.blind.judged import HEADLINE


def at_least(floor_, trials, chance):
    """P(X ≥ floor), summed term by term."""
    return sum(math.comb(trials, k) * chance**k * (1 - chance) ** (trials - k) for k in range(floor_, trials + 1))


def rates(chance, trials=None):
    found = {}
    for kind, question in TARGETS:
        n = trials or COUNTS[kind]
        found.setdefault(kind, {})[question] = {"successes": math.floor(chance * n), "trials": n}
    return found


@pytest.mark.parametrize(("kind", "question"), TARGETS)
def test_a_program_right_in_four_of_five_hardly_ever_passes_a_question(kind, question):
    # a tenth of the cases may be withdrawn
    trials, target = math.ceil(0.9 * COUNTS[kind]), TARGETS[kind, question]
    assert at_least(floor(target, trials), trials, POOR) < 1e-3


def test_a_program_that_reaches_every_target_nearly_always_passes_all():
    missed = sum(1.0 - at_least(floor(t, COUNTS[kind]), COUNTS[kind], t) for (kind, _), t in TARGETS.items())
    assert missed < 0.01


def test_a_floor_is_not_lower_than_it_must_be():
    for (kind, _), target in TARGETS.items():
        higher = floor(target, COUNTS[kind]) + 1
        assert 1.0 - at_least(higher, COUNTS[kind], target) > 0.01 / len(TARGETS)


def test_right_everywhere_passes_and_80_percent_or_too_few_cases_fail():
    assert all(passes for _, passes in judged(rates(1.0)))
    assert not any(passes for _, passes in judged(rates(0.8)))
    few = judged(rates(1.0, 20))
    assert not any(passes for _, passes in few)
    assert all("too few" in line for line, _ in few)
    assert not any(passes for _, passes in judged({}))


def test_every_kind_of_the_floors_is_asked_its_headline_or_more():
    for kind, question in TARGETS:
        assert question == HEADLINE[kind] or kind == "unlisted"
