"""Optimal design of the next measurement: samples that discriminate between explanations, or a missing column.

Each leading explanation k is a linear model with a normal posterior, y = A f + Σ_b X_b θ_b + e: what it expects of
samples S is N(μ_k, V_k), V_k = A_S Σ_k A_S' + noise. Under explanation i, samples S are expected to bring a log Bayes
factor of i against j of

    KL(i, j) = ½ [ tr V_j⁻¹ V_i + (μ_i − μ_j)' V_j⁻¹ (μ_i − μ_j) − |S| + ln |V_j| / |V_i| ]   nats

(Box and Hill, *Technometrics* 9, 1967; Hill, Hunter and Wichern, *Technometrics* 10, 1968). What is maximised is that
of the true explanation against its nearest rival, Σ_i p_i min_j KL(i, j), with p the posterior probabilities. Samples
are chosen greedily, one after the other. Where one explanation is settled, or no sample could tell it from another,
they are D-optimal for its parameters, with the frames unknown. Where the robot is led to sockets or planes, samples are
postures in which it reaches those that are there. Collisions and the line of sight of the instrument are not checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import APART, CLOCK, KIND, KINDS, TOUCHED
from thermal_robot.campaign.settings import ABSOLUTE_ZERO
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.values import Finding, Unexplained, Wanted, is_frame
from thermal_robot.effects import gate
from thermal_robot.effects.law_words import TELLS, WHETHER, kind_of
from thermal_robot.errors import CampaignError
from thermal_robot.inference.algebra import equations_of, solve
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, products
from thermal_robot.inference.settings import FEW_LEVELS, IN_ITS_PLACE
from thermal_robot.observables.plane import OnPlane
from thermal_robot.observables.socket import Socket, Stand
from thermal_robot.observations import Frames, Observations, observe
from thermal_robot.robot import joint_range
from thermal_robot.simulation.brought import closed

if TYPE_CHECKING:
    import pandas as pd

Effects = tuple[str, ...]

_ANSWERS = ("torque", "encoder")  # columns that answer a sample, and cannot be asked for
_OF_JOINTS = ("approach", "torque", "velocity", "acceleration")


def most_informative(
    root: Array, frames: Array, count: int, alike: NDArray[np.int64] | None = None
) -> tuple[list[int], list[float]]:
    """Greedy D-optimal Bayesian design beside unknown frames (Chaloner and Verdinelli, *Statistical Science* 10, 1995).

    Each choice maximises I(y; θ) = I(y; θ, f) − I(y; f | θ), f the frames: half the difference of two log determinants,
    given those before. Returns the chosen candidates, and the cumulative information, nats.

    ``root`` (K, m, p) and ``frames`` (K, m, f): root of the covariance of what is expected of each candidate's m
    components, in units of the noise, and of its part from the frames, were the parameters known. Of candidates with
    the same number in ``alike`` (K,) only one is chosen.
    """
    alike = np.arange(len(root)) if alike is None else alike
    free = np.ones(len(root), dtype=bool)
    chosen: list[int] = []
    gains: list[float] = []
    for _ in range(count):
        information = np.where(free, _log_det(root) - _log_det(frames), -np.inf)
        row = int(information.argmax())
        chosen.append(row)
        gains.append(float(information[row]))
        root, frames = _learnt(root, root[row]), _learnt(frames, frames[row])
        free &= alike != alike[row]
    return chosen, np.cumsum(gains).tolist()


def _log_det(root: Array) -> Array:
    """Half the log determinant (K,) of root root' + 1 of each candidate, nats."""
    return np.asarray(0.5 * np.linalg.slogdet(root @ root.transpose(0, 2, 1) + np.eye(root.shape[1]))[1])


def _learnt(root: Array, row: Array) -> Array:
    """Square root (K, m, p) of the covariance after a sample (m, p): root (1 + row' row)^(−½)."""
    if not row.size:
        return root
    _, value, along = np.linalg.svd(row, full_matrices=False)
    return np.asarray(root - ((root @ along.T) * (1.0 - 1.0 / np.sqrt(1.0 + value**2))) @ along)


@dataclass(frozen=True)
class NextSample:
    """Proposed sample of the optimal design.

    ``position``: joint positions by name, rad or m. ``conditions`` that the explanations depend on, by column, SI;
    ``time`` is a proposal, any later one will do. ``labels`` say to what the sample goes, such as a stand and a socket,
    by column. ``separates``: the explanations that it tells apart best, each a
    tuple of effects (empty: noise alone); a single one if that is settled and the sample improves its parameters.
    ``gain`` of this sample and those before it, nats: the expected log Bayes factor of the true explanation against its
    nearest rival, or the information about the parameters of a single one.
    """

    position: dict[str, float]
    conditions: dict[str, float]
    separates: tuple[Effects, ...]
    gain: float
    labels: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class NextSamples:
    """Designed samples, the most informative first.

    ``commands`` are the same as a campaign without measurements, with a value in every column.
    """

    samples: tuple[NextSample, ...]
    commands: Campaign

    def to_list(self) -> list[dict[str, Any]]:
        """List under ``next.samples`` of the JSON."""
        return [
            {
                "joints": dict(sample.position),
                "conditions": dict(sample.conditions),
                "separates": [list(effects) for effects in sample.separates],
                "gain": sample.gain,
                **({"labels": dict(sample.labels)} if sample.labels else {}),
            }
            for sample in self.samples
        ]

    def to_table(self) -> pd.DataFrame:
        """Return the data frame in the campaign's units with its file's columns, ``separates`` and ``gain``."""
        import pandas as pd

        robot, units = self.commands.robot, self.commands.units
        scale = {n: units.joint_scale(kind) for n, kind in zip(robot.joint_names, robot.joint_types, strict=True)}
        rows = []
        for sample in self.samples:
            row: dict[str, Any] = {name: value / scale[name] for name, value in sample.position.items()}
            for name, value in sample.conditions.items():
                column, _, joint = name.partition(".")
                row[name] = value / scale[joint] if column in ("velocity", "acceleration") else value
            row |= sample.labels
            row["separates"] = " | ".join(" + ".join(effects) or "nothing" for effects in sample.separates)
            rows.append({**row, "gain": sample.gain})
        return pd.DataFrame(rows)


def next_samples(fit: Fit, count: int = 10, seed: int = 0, loads: Sequence[float] = ()) -> NextSamples:
    """Greedy model discrimination over :func:`candidates`; no samples where none would be informative.

    Raises :class:`CampaignError` if ``count`` is no whole number above 0.
    """
    if not isinstance(count, (int, np.integer)) or count < 1:
        expected = "a whole number above 0"
        raise CampaignError("next_samples()", "cannot propose so many", found=repr(count), expected=expected)
    offered = candidates(fit, seed, loads)
    if not offered.samples:
        return NextSamples((), offered)
    leading, probability = _leading(fit)
    models = _predictive(fit, observe(offered, fit.corrected.frames), leading)
    count = min(int(count), offered.samples)
    chosen, pairs, gains = _chosen(models, probability, count)
    if len(models) > 1 and probability[0] > settings.DECIDED and max(gains) < settings.WORTHWHILE:
        chosen, pairs, gains = _chosen(models[:1], np.ones(1), count)
    if max(gains) <= 0.0:
        chosen, pairs, gains = [], [], []  # there is nothing to learn
    names = [_effects(fit, c) for c in leading]
    robot, read = offered.robot, _conditions(fit, leading)
    samples = tuple(
        NextSample(
            dict(zip(robot.joint_names, offered.q[row].tolist(), strict=True)),
            {name: float(offered.covariates[name][row]) for name in read},
            tuple(names[k] for k in pair),
            gain,
            _labels(offered, row),
        )
        for row, pair, gain in zip(chosen, pairs, gains, strict=True)
    )
    return NextSamples(samples, offered.take(np.array(chosen, dtype=np.int64)))


def candidates(fit: Fit, seed: int = 0, loads: Sequence[float] = (), pool: int = 400) -> Campaign:
    """Candidate pool of samples that could be measured next, as a campaign without measurements.

    Joint positions are uniform within the limits, and within 2.4 rad for a joint that can turn once round; the
    range of the campaign is always included. Temperatures are the campaign's lowest and highest, and 5 K beyond them,
    alike for all links. Payloads are those of the campaign, or none and ``loads``, kg, where these are given. Joints
    are approached from either side. Times follow the campaign, for as long as it lasted. Other columns are copied from
    a random row; torques and encoder readings from the row with the nearest pose. Where rows touch something, the robot
    as fitted is led from these joint positions to what the random row touched, on a plane between places where it was
    touched; what it does not reach is left out.
    """
    from scipy.spatial import cKDTree

    campaign, rng = fit.campaign, np.random.default_rng(seed)
    there = np.flatnonzero(~np.isin(_kind_of_rows(campaign), APART))
    rows = there[rng.integers(len(there), size=pool)]
    low, high = _range(campaign)
    q = rng.uniform(low, high, (pool, campaign.robot.n))
    alike = cKDTree(campaign.q / (high - low + 1e-9)).query(q / (high - low + 1e-9))[1]
    level, late = rng.integers(4, size=pool), rng.uniform(size=pool)
    covariates = {}
    for name, values in campaign.covariates.items():
        kind, first, last = name.partition(".")[0], float(values.min()), float(values.max())
        if kind == "temperature":
            levels = [first - settings.BEYOND, first, last, last + settings.BEYOND]
            covariates[name] = np.maximum(levels, ABSOLUTE_ZERO)[level]
        elif kind == "payload":
            seen = np.unique(values)
            covariates[name] = rng.choice(seen if len(seen) < FEW_LEVELS else [first, last], pool)
        elif kind == "approach":
            covariates[name] = rng.choice([-1.0, 1.0], pool)
        elif kind in CLOCK:
            after = last + late * (last - first)
            covariates[name] = np.ceil(after) if kind == "order" else after
        else:
            covariates[name] = values[alike if kind in _ANSWERS else rows]
    if loads:
        covariates["payload"] = rng.choice([0.0, *loads], pool)
    # orientation only says what is measured; the simulator knows nothing of new poses, and columns do not ask it
    offered = replace(
        campaign.take(rows),
        q=q,
        position=None,
        orientation=None if campaign.orientation is None else np.tile([1.0, 0.0, 0.0, 0.0], (pool, 1)),
        simulated_position=None,
        simulated_orientation=None,
        covariates=covariates,
        missing={},
        rows=np.arange(2, pool + 2),
    )
    return _led(fit, offered, rng)


def _kind_of_rows(campaign: Campaign) -> NDArray[np.str_]:
    """(N,) kind of measurement of each row."""
    return np.asarray(campaign.labels.get(KIND, np.full(campaign.samples, campaign.measures)))


def _led(fit: Fit, offered: Campaign, rng: np.random.Generator) -> Campaign:
    """Candidates with the joint positions (N, n) in which the robot as fitted touches what they name."""
    touched = np.flatnonzero(np.isin(_kind_of_rows(offered), TOUCHED))
    if not len(touched):
        return offered
    led, reached = closed(*_aimed(fit, offered.take(touched), rng), fit.effects)
    q, kept = offered.q.copy(), np.ones(offered.samples, dtype=bool)
    q[touched], kept[touched] = led.q, reached
    found = replace(offered, q=q).take(np.flatnonzero(kept))
    return replace(found, rows=np.arange(2, found.samples + 2))


def _aimed(fit: Fit, rows: Campaign, rng: np.random.Generator) -> tuple[Campaign, Frames]:
    """Return rows with a point on each plane to aim at, as a socket there, and the frames with these points.

    A point lies between two where the plane was touched: a table, or the face of a block, ends somewhere.
    """
    frames, onto = fit.corrected.frames, _kind_of_rows(rows) == OnPlane.kind
    if not onto.any():
        return rows, frames
    places = fit.corrected.position @ frames.base[:3, :3].T + frames.base[:3, 3]
    before = ~fit.explanation.outliers & (_kind_of_rows(fit.campaign) == OnPlane.kind)
    points, heights = np.zeros((rows.samples, 3)), rows.readings.get("height", np.zeros(rows.samples))
    for name in np.unique(rows.labels[OnPlane.label][onto]):
        plane, mine = frames.artefacts[f"{OnPlane.label} {name}"], onto & (rows.labels[OnPlane.label] == name)
        known = np.flatnonzero(before & (fit.campaign.labels[OnPlane.label] == name))
        one, other = places[rng.choice(known, (2, int(mine.sum())))]
        between = one + rng.uniform(size=(len(one), 1)) * (other - one)
        points[mine] = between - np.outer(between @ plane.normal - plane.offset - heights[mine], plane.normal)
    # no stand of the campaign has an empty name
    number, blank = np.arange(rows.samples).astype(str), np.full(rows.samples, "")
    aim = {KIND: np.full(rows.samples, Socket.kind), Socket.label: blank, "socket": number}
    labels = {**rows.labels, **{name: np.where(onto, own, rows.labels.get(name, blank)) for name, own in aim.items()}}
    stand = Stand(tuple(number[onto].tolist()), points[onto])
    return replace(rows, labels=labels), replace(frames, artefacts={**frames.artefacts, f"{Socket.label} ": stand})


def _labels(offered: Campaign, row: int) -> dict[str, str]:
    """Return what a candidate has to do with beside the robot, by column."""
    own = KINDS.get(str(_kind_of_rows(offered)[row]), ((), ()))[1]
    return {name: str(offered.labels[name][row]) for name in own}


def _range(campaign: Campaign) -> tuple[Array, Array]:
    low, high = joint_range(campaign.robot)
    low = np.where(np.isfinite(low), low, np.inf)
    high = np.where(np.isfinite(high), high, -np.inf)
    return np.minimum(low, campaign.q.min(axis=0)), np.maximum(high, campaign.q.max(axis=0))


def _effects(fit: Fit, combination: Combination) -> Effects:
    return tuple(sorted(fit.names_of(combination)))


def _leading(fit: Fit) -> tuple[list[Combination], Array]:
    """Leading explanations with their most probable settings, and their probabilities."""
    e = fit.explanation
    best: dict[Effects, Combination] = {}
    total: dict[Effects, float] = {}
    for combination, probability in zip(e.combinations, e.probabilities, strict=True):
        effects = _effects(fit, combination)
        best.setdefault(effects, combination)
        total[effects] = total.get(effects, 0.0) + float(probability)
    order = sorted(total, key=lambda effects: -total[effects])[: settings.MOST_LEADING]
    least = IN_ITS_PLACE if len(order) > 1 and total[order[1]] > IN_ITS_PLACE else settings.LEAST_LEADING
    kept = [effects for k, effects in enumerate(order) if k == 0 or total[effects] > least]
    probability = np.array([total[effects] for effects in kept])
    return [best[effects] for effects in kept], probability / probability.sum()


def _conditions(fit: Fit, leading: Sequence[Combination]) -> list[str]:
    """Columns that an explanation depends on and that can be commanded."""
    listed = {b for combination in leading for b in combination.blocks}
    read = {name for b in listed for name in gate.reads(fit.explanation.linear.blocks[b].effect, fit.nominal)}
    return [n for n in fit.campaign.covariates if n in read and n.partition(".")[0] not in _ANSWERS]


@dataclass(frozen=True, eq=False)
class _Predictive:
    """Predictive distribution of the candidates under one explanation, in units of the noise: N(mean, root root' + 1).

    ``mean`` (K, m), ``root`` (K, m, p) of the covariance, ``frames`` (K, m, f) its part were the effects known.
    """

    mean: Array
    root: Array
    frames: Array


def _predictive(fit: Fit, offered: Observations, leading: Sequence[Combination]) -> list[_Predictive]:
    e = fit.explanation
    relative = offered.campaign.relative_noise
    noise = e.whitening.noise * e.best.noise * (1.0 if relative is None else relative)
    flat = e.linear.frames.shape[2]
    index = sorted({b for combination in leading for b in combination.blocks})
    items = [e.linear.blocks[b] for b in index]
    # rows that are alike are worth less, as in the explanation itself
    gram = products(Linear(e.linear.gap, e.linear.frames, tuple(items)), e.whitening) / e.best.noise**2
    # the simulator's own tool is never refitted: its columns come last and are left out
    columns = [frame_columns(offered)[0][:, :, :flat], *(block(offered, i.effect).columns for i in items)]
    asked = np.concatenate(columns, axis=2) / np.atleast_2d(noise)[:, :, None]
    of = np.repeat([-1, *index], [flat, *(len(item.sizes) for item in items)])  # the block of each column
    found = []
    for combination in leading:
        own = [b for b in index if b in combination.blocks]
        picked = np.flatnonzero(np.isin(of, [-1, *own]))
        sizes = (e.linear.blocks[b].sizes * combination.scales[b] for b in own)
        size = np.concatenate([np.full(flat, settings.LOOSE), *sizes])
        precision = gram[np.ix_(picked, picked)] * np.outer(size, size) + np.eye(len(size))
        mean = size * solve(precision, gram[picked, -1] * size)
        design = asked[:, :, picked]
        root, frames = _root(design * size, precision), _root((design * size)[:, :, :flat], precision[:flat, :flat])
        found.append(_Predictive(design @ mean, root, frames))
    return found


def _root(design: Array, precision: Array) -> Array:
    """Square root (K, m, p) of the covariance of design · N(0, precision⁻¹), the precision at least the prior's, 1."""
    value, vector = np.linalg.eigh(precision)
    return np.asarray(design @ (vector / np.sqrt(np.maximum(value, 1.0))))


class _Conditional:
    """Conditional distribution of every candidate given the chosen samples S: mean y_c − B y_S, root ``learnt``."""

    def __init__(self, root: Array, learnt: Array, chosen: Sequence[int]) -> None:
        past, one = equations_of(root[list(chosen)]), np.eye(root.shape[1])
        self.own = root @ root.transpose(0, 2, 1) + one
        self.cross, self.past = root @ past.T, past @ past.T + np.eye(len(past))
        along, size, across = np.linalg.svd(past, full_matrices=False)
        self.gain = ((root @ across.T) * (size / (1.0 + size**2))) @ along.T
        value, vector = np.linalg.eigh(learnt @ learnt.transpose(0, 2, 1) + one)
        value = np.maximum(value, 1.0)  # below it there is rounding alone
        self.inverse = (vector / value[:, None, :]) @ vector.transpose(0, 2, 1)
        self.log_det = np.log(value).sum(axis=1)


def _increase(i: _Conditional, j: _Conditional, apart: Array, chosen: Sequence[int]) -> Array:
    """Increase (K,) of the Kullback-Leibler divergence KL(i, j) by each candidate; ``apart`` is μ_i − μ_j."""
    left = apart - j.gain @ apart[list(chosen)].ravel()
    trace = (j.inverse * i.own).sum(axis=(1, 2)) + ((j.inverse @ left[:, :, None])[:, :, 0] * left).sum(axis=1)
    if len(chosen):
        trace += ((j.inverse @ j.gain) * (j.gain @ i.past - 2.0 * i.cross)).sum(axis=(1, 2))
    return np.asarray(0.5 * (trace - apart.shape[1] + j.log_det - i.log_det))


def _chosen(
    models: Sequence[_Predictive], probability: Array, count: int
) -> tuple[list[int], list[tuple[int, ...]], list[float]]:
    """Greedy choice of rows, the pair of explanations that each separates best, and the cumulative gain."""
    number = len(models)
    if number == 1:
        alone, gained = most_informative(models[0].root, models[0].frames, count)
        return alone, [(0,)] * count, gained
    itself = np.eye(number, dtype=bool)[:, :, None]
    so_far, learnt, frames = np.zeros((number, number)), [model.root for model in models], models[0].frames
    chosen: list[int] = []
    pairs: list[tuple[int, ...]] = []
    gains: list[float] = []
    for _ in range(count):
        known = [_Conditional(model.root, root, chosen) for model, root in zip(models, learnt, strict=True)]
        information = 0.5 * known[0].log_det - _log_det(frames)
        added = np.zeros((number, number, len(information)))
        for i, j in np.argwhere(~itself[:, :, 0]):
            added[i, j] = _increase(known[i], known[j], models[i].mean - models[j].mean, chosen)
        reached = so_far[:, :, None] + added
        expected = probability @ np.where(itself, np.inf, reached).min(axis=1)
        score = expected + settings.TIE * information
        score[chosen] = -np.inf
        row = int(score.argmax())
        chosen.append(row)
        gains.append(float(expected[row]))
        learnt, frames = [_learnt(root, root[row]) for root in learnt], _learnt(frames, frames[row])
        so_far = reached[:, :, row]
        both = np.outer(probability, probability) * (added[:, :, row] + added[:, :, row].T)
        pairs.append(tuple(sorted(int(k) for k in np.unravel_index(both.argmax(), both.shape))))
    return chosen, pairs, gains


def wanted(
    fit: Fit,
    found: Sequence[Finding],
    groups: Sequence[Effects],
    left: Unexplained,
    laws: Unexplained,
    probability: float,
) -> Wanted | None:
    """Most useful next measurement; ``None`` where the data determine the explanation.

    ``groups``: effects that the data cannot tell apart; ``left`` and ``laws``: residuals of the whole fit, and of the
    known effects alone; ``probability`` of the explanation.
    """
    if groups:
        group = groups[0]
        needs = {f.name: f.needs for f in found}
        frame = next((need for name in group for need in needs.get(name, ()) if need.startswith("frames.")), "")
        if frame or any(is_frame(found, name) for name in group):
            return Wanted("frame", frame, apart=group[:2])
        if any(needs.get(name) == ("pose",) for name in group):
            return Wanted("repeats", "pose", apart=group[:2])
        return _pose(fit, group) or Wanted("range", apart=group[:2])
    if left.flagged:
        return _column(fit, found, laws) or _column(fit, found, left) or Wanted("repeats")
    if laws.flagged:
        return _column(fit, (), laws)  # laws say it all: a column may still tell what they are
    return _pose(fit, ()) if probability < settings.DECIDED else None


def _pose(fit: Fit, group: Effects) -> Wanted | None:
    """Sample that separates explanations best, or another payload where that separates clearly more.

    ``None`` where no sample gains enough, or only samples that separate effects outside the group.
    """
    plain = loaded = next_samples(fit)
    if fit.campaign.robot.has_masses and not fit.nominal.varies("payload"):
        loaded = next_samples(fit, loads=(settings.LOAD,))
    (apart, gain), (with_load, more) = _apart(plain, group), _apart(loaded, group)
    if more > max(0.0 if group else settings.WORTHWHILE, settings.PAYS * gain):
        return Wanted("column", "payload", apart=with_load)
    if gain < settings.WORTHWHILE:
        return None
    sample = plain.samples[0]
    # when it is measured, and from where the joints come, matters less than where they are
    set_up = {name: v for name, v in sample.conditions.items() if name.partition(".")[0] not in (*CLOCK, *_OF_JOINTS)}
    return Wanted("pose", apart=apart, position=sample.position, conditions=set_up, labels=sample.labels)


def _apart(samples: NextSamples, group: Effects) -> tuple[Effects, float]:
    """Effects of only one of the two explanations that the first sample separates, and all samples' gain, nats."""
    if not samples.samples or len(samples.samples[0].separates) < 2:
        return (), 0.0
    one, other = map(set, samples.samples[0].separates)
    apart = tuple(sorted(one ^ other))
    return (apart, samples.samples[-1].gain) if apart and (not group or set(apart) & set(group)) else ((), 0.0)


def _column(fit: Fit, found: Sequence[Finding], left: Unexplained) -> Wanted | None:
    """Missing column that would explain a residual; ``None`` where there is none to record."""
    kind, place = next(((p.kind, p.name) for p in left.locations), ("", ""))
    follows = next((d.covariate for d in left.depends_on), "")
    missing = [f for f in found if f.status == "not_testable" and not is_frame(found, f.name)]
    # what is no column, such as masses in the URDF, cannot be recorded; repeats are not recorded but made
    needed = [n.partition(".")[0] for f in missing for n in f.needs if " " not in n and n != "pose"]
    kinds = [kind_of(name, place, fit.campaign.robot.joint_names) for name in (follows or "none").split(" * ")]
    telling = [column for kind in kinds for column in TELLS.get(kind, ())]
    for column in (*telling, *sorted(needed, key=lambda c: (c in _OF_JOINTS) != (kind == "joint"))):
        name = f"{column}.{place}" if column in _OF_JOINTS and kind == "joint" else column
        known = [c for c in fit.campaign.covariates if c == name or c.partition(".")[0] == name]
        if not any(fit.nominal.varies(c) for c in known):
            untested = tuple(f.name for f in missing if column in {n.partition(".")[0] for n in f.needs})
            words = next((p.words for p in left.locations), "")
            whether = WHETHER.get(column, "")
            return Wanted("column", name, untested=untested, whether=whether, place=words, follows=follows)
    return None
