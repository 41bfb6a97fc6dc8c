"""One evidence: of every combination beside every discrepancy, and the sum over them."""

from dataclasses import replace
from itertools import combinations, permutations, product

import numpy as np
import pytest
from helpers import some
from inference.densities import dense, direct, volume
from inference.problems import small_problem
from scipy.special import logsumexp

from thermal_robot.inference import settings
from thermal_robot.inference.evidence import evidence
from thermal_robot.inference.explain import PLAIN, ModelSearch
from thermal_robot.inference.kernels import Kernel

PRIOR = (-1.0, -2.0, -0.5)
CHOSEN = [c for size in range(4) for c in combinations(range(3), size)]


def two_forms(rows, seed=0):
    """One that is the same matrix for all rows, few functions; one of a matrix each, more functions than rows."""
    rng = np.random.default_rng(seed)
    narrow = Kernel("narrow", rng.normal(size=(rows, 3)), np.eye(3))
    wide = Kernel("wide", rng.normal(size=(rows, 40)), rng.normal(size=(rows, 3, 2)))
    return [narrow, wide]


def inside(kernel, whitening):
    """Dense covariance of a kernel, weighed, of the rows in use, in units of the noise."""
    root = np.repeat(np.sqrt(whitening.weights), 3)
    used = root > 0.0
    return (root[:, None] * dense(kernel, whitening.noise) * root)[np.ix_(used, used)]


def drawn(seed, rows=24, present=(1,), tau=0.0, which=0):
    """A small problem with a discrepancy of known kernel and amplitude, and the model search on it."""
    linear, whitening = small_problem(seed, rows=rows, present=present)
    whitening = replace(whitening, weights=np.where(whitening.weights > 0, 1.0, 0.0))
    offered = two_forms(rows, seed)
    if tau:
        rng = np.random.default_rng([seed, 5])
        covariance = dense(offered[which], whitening.noise)
        value, vector = np.linalg.eigh(covariance)
        error = tau * (vector * np.sqrt(np.maximum(value, 0.0))) @ rng.normal(size=3 * rows)
        linear = replace(linear, gap=linear.gap + error.reshape(rows, 3))
    return linear, whitening, ModelSearch(linear, whitening, offered, PRIOR)


def belief(models):
    """Probability that there is a discrepancy; those of all kernels and of none are one."""
    odds = models.kernel_probabilities()
    assert sum(odds.values()) == pytest.approx(1.0)
    return 1.0 - odds.get("", 0.0)


def hyperparameters(models):
    return [PLAIN, *((k, tau) for k in range(len(models.kernels)) for tau in settings.TAUS)]


def less_density(models, hyper, blocks, beside):
    """What the evidence of a combination beside a discrepancy is more than the density of the gap."""
    linear, whitening, search = models.linear, models.whitening, models.search_at(hyper)
    found = evidence(search.gram, blocks, sum(search.log_prior[b] for b in blocks), None)
    density = direct(linear, whitening, found, PRIOR, beside=beside)
    return found.log_evidence - density - volume(linear, whitening, found, beside=beside)


def near_nothing(off):
    """A peak over ln λ that is flatter than a parabola can tell is bounded: its density has no such volume."""
    every = np.array(off)
    off = every[np.isfinite(every)]
    assert len(off) > 0.8 * len(every)
    assert np.mean(np.abs(off) < 1e-5) > 0.9
    assert off.max() < 0.6


def test_evidence_beside_a_discrepancy_is_the_density_of_the_gap():
    """Of all combinations and hyperparameters, but for one constant and the prior odds of the latter."""
    for seed in range(1):
        linear, whitening = small_problem(seed, rows=12, present=(1,))
        offered, off = two_forms(12, seed), []
        models = ModelSearch(linear, whitening, offered, PRIOR)
        for hyper in (PLAIN, (0, 0.5), (0, 8.0), (1, 1.0), (1, 16.0)):
            kernel, tau = hyper
            beside = None if kernel < 0 else tau**2 * inside(offered[kernel], whitening)
            # two kernels share what a discrepancy is given, and so do the sizes of each
            odds = np.log(0.5) if kernel < 0 else np.log(0.5 / (2 * len(settings.TAUS)))
            off += [less_density(models, hyper, blocks, beside) - odds for blocks in CHOSEN]
        near_nothing(off - np.nanmedian(off))


def everything(models):
    """Log evidence of all combinations beside all hyperparameters, each computed."""
    return {
        (hyper, blocks): models.search_at(hyper).evaluate(blocks).log_evidence
        for hyper in hyperparameters(models)
        for blocks in CHOSEN
    }


@pytest.mark.parametrize(
    ("present", "tau", "seeds"),
    [
        ((0, 2), 4.0, range(1)),
        ((), 0.0, range(1)),
        *(
            pytest.param(*own, range(6), marks=pytest.mark.slow)
            for own in product(((), (1,), (0, 2)), (0.0, 0.7, 4.0, 20.0))
        ),
    ],
)
def test_the_best_and_summed_probabilities_are_those_of_all_combinations_and_discrepancies(present, tau, seeds):
    """Hyperparameters 4 nats below the best, left out of the sum, change none by more than some hundredths."""
    for seed in seeds:
        linear, whitening, models = drawn(seed, present=present, tau=tau, which=(seed + len(present)) % 2)
        best = models.run()[1]
        compared, chances = models.probabilities()
        assert chances.sum() == pytest.approx(1.0)
        assert (np.diff(chances) <= 0.0).all()
        log = everything(ModelSearch(linear, whitening, models.kernels, PRIOR))
        assert best.log_evidence == pytest.approx(max(log.values()), abs=1e-2)
        total = logsumexp(list(log.values()))
        for b in range(3):
            ours = sum(p for c, p in zip(compared, chances, strict=True) if b in c.blocks)
            brute = np.exp(logsumexp([v for (_, blocks), v in log.items() if b in blocks]) - total)
            assert ours == pytest.approx(brute, abs=0.04)
        brute = 1.0 - np.exp(logsumexp([v for (hyper, _), v in log.items() if hyper == PLAIN]) - total)
        assert belief(models) == pytest.approx(brute, abs=0.04)


def test_where_the_search_starts_and_in_which_order_does_not_matter():
    for seed in range(1):
        answers = set()
        for order in ((), *permutations([(0,), (1, 2), (2,)])):
            _, _, models = drawn(seed, present=(0, 2), tau=3.0)
            hyper, best = models.run(order) if order else models.run()
            answers.add((hyper, best.blocks, round(best.log_evidence, 2)))
        assert len(answers) == 1, answers


@pytest.mark.parametrize("which", [0, 1], ids=["one matrix", "by row"])
def test_form_and_size_of_a_discrepancy_are_told(which):
    sizes, beliefs = [], []
    for seed in range(4):
        _, _, models = drawn(seed, rows=40, tau=4.0, which=which)
        (kernel, tau), best = models.run()
        assert best.blocks == (1,)
        beliefs.append(belief(models))
        sizes.append(tau if kernel == which else np.nan)
    assert min(beliefs) > 0.99
    assert np.isfinite(sizes).mean() >= 0.9
    assert 2.0 < np.nanmedian(sizes) < 8.0


@pytest.mark.parametrize("tau", some([3.0, 0.0], 2))
def test_without_a_block_the_search_is_as_if_it_never_had_it(tau):
    """The best, and what is probable beside it, whatever was weighed before."""
    for seed in range(2):
        _, _, models = drawn(seed, present=(1, 2), tau=tau, which=seed % 2)
        _, _, fresh = drawn(seed, present=(1, 2), tau=tau, which=seed % 2)
        models.run()
        found, never = models.without(frozenset({1})), fresh.without(frozenset({1}))
        best, other = found.run()[1], never.run()[1]
        assert best.blocks == other.blocks
        assert best.log_evidence == pytest.approx(other.log_evidence, abs=1e-2)
        chances = [one.probabilities() for one in (found, never)]
        for b in range(3):
            one, two = (sum(p for c, p in zip(*own, strict=True) if b in c.blocks) for own in chances)
            assert one == pytest.approx(two, abs=0.04)
            assert b != 1 or one == 0.0
        assert belief(found) == pytest.approx(belief(never), abs=0.04)
        # the evidence is that of the problem of the other blocks alone
        alone = ModelSearch(
            replace(models.linear, blocks=(models.linear.blocks[0], models.linear.blocks[2])),
            models.whitening,
            models.kernels[:2],
            (PRIOR[0], PRIOR[2]),
        )
        assert best.log_evidence == pytest.approx(alone.run()[1].log_evidence, abs=1e-2)


def test_forms_that_are_out_of_the_question_are_told():
    """A discrepancy of one kernel, twenty times the noise: the other is no rival, and that there is none even less."""
    _, _, models = drawn(5, rows=40, tau=20.0, which=0)
    hyper, best = models.run()
    assert hyper[0] == 0
    assert [kernel.name for kernel in models.plausible_kernels(best)] == ["narrow"]
    # where nothing is there, each is most probable at the smallest size, and so out of the question
    _, _, models = drawn(5, rows=40)
    hyper, best = models.run()
    assert hyper == PLAIN
    assert models.plausible_kernels(best) == ()


SCATTERED = ("joint_2", "joint_4")


def scattering(places, seed, rows=60, tau=6.0, present=()):
    """Rows of which several joints, or one, err anew by so many times the noise; five joints on offer."""
    rng = np.random.default_rng([seed, 9])
    linear, whitening = small_problem(seed, rows=rows, present=present)
    whitening = replace(whitening, weights=np.ones(rows))
    offered, gap, each = [], linear.gap, np.arange(rows, dtype=float)
    for k in range(1, 6):
        moves = rng.normal(size=(rows, 3, 1))
        name = f"joint_{k}"
        offered.append(Kernel(f"poses, {name}", each, moves, True, ("joint", name)))
        if name in places:
            gap = gap + tau * (moves @ rng.normal(size=(rows, 1, 1)))[:, :, 0]
    return ModelSearch(replace(linear, gap=gap), whitening, offered, PRIOR)


@pytest.mark.parametrize("present", [(), (1,)], ids=["alone", "beside an effect"])
def test_a_joint_that_scatters_is_told(present):
    for seed in range(5):
        models = scattering(SCATTERED[:1], seed, present=present)
        hyper, best = models.run()
        assert models.kernels[hyper[0]].name == "poses, joint_2"
        assert best.blocks == present
        assert belief(models) > 0.999


def test_an_evidence_beside_a_joint_that_scatters_is_that_of_its_covariance():
    """But for a constant: against the gap's density."""
    models = scattering(SCATTERED, 2, rows=30, present=(1,))
    models.run()
    one = models.kernels.index(next(kernel for kernel in models.kernels if kernel.name == "poses, joint_2"))
    off = []
    for number, tau in ((one, 1.0), (one, 8.0)):
        kernel = replace(models.kernels[number], functions=np.eye(30))
        beside = tau**2 * inside(kernel, models.whitening)
        own = [less_density(models, (number, tau), blocks, beside) for blocks in CHOSEN]
        off += (own - np.nanmedian(own)).tolist()
    near_nothing(off)


def test_joints_are_as_probable_however_often_blocks_are_left_out():
    """Weaker than the noise, so that one joint and the other are in question."""
    models, odds = scattering(SCATTERED, 1, tau=0.7, present=(1,)), []
    models.run()
    for _ in range(3):
        models = models.without(frozenset({0}))
        models.run([(1,)])
        odds.append(models.kernel_probabilities())
    for again in odds[1:]:
        assert {name: again.get(name, 0.0) for name in odds[0]} == pytest.approx(odds[0], abs=0.05)


@pytest.mark.parametrize(
    ("seen", "names", "best"),
    [
        # two settings of one name, each less probable than another effect, are more probable together
        ({(PLAIN, (0,)): 0.0, (PLAIN, (1,)): -0.3, (PLAIN, (2,)): -0.5}, "abb", (1,)),
        ({(PLAIN, (0,)): 0.0, (PLAIN, (1,)): -0.3, (PLAIN, (2,)): -0.5}, "abc", (0,)),
        # and so is one beside several discrepancies
        (
            {(PLAIN, (1,)): -0.2, ((0, 1.0), (1,)): -0.3, ((1, 2.0), (1,)): -0.4, ((0, 2.0), (0,)): 0.0},
            "abc",
            (1,),
        ),
    ],
)
def test_the_consensus_is_the_best_setting_of_the_most_probable_name(seen, names, best):
    linear, whitening, _ = drawn(4, present=())
    models = ModelSearch(linear, whitening, two_forms(24), PRIOR)
    for hyper in dict.fromkeys(hyper for hyper, _ in seen):
        search = models.search_at(hyper)
        own = {blocks: log for (beside, blocks), log in seen.items() if beside == hyper}
        search.seen = {blocks: replace(search.evaluate(blocks), log_evidence=log) for blocks, log in own.items()}
    hyper, found = models.consensus(list(names))
    assert (hyper, found.blocks) == (PLAIN, best)
