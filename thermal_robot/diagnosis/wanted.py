"""The one thing to measure or to record next: a frame, a pose, a column; nothing where nothing is needed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from thermal_robot.campaign.names import CLOCK
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.next_samples import NextSamples, next_samples
from thermal_robot.diagnosis.parts import Finding, Unexplained, Wanted, is_frame
from thermal_robot.effects.law_words import TELLS, WHETHER, kind_of
from thermal_robot.inference.fit import Fit

_OF_JOINTS = ("approach", "torque", "velocity", "acceleration")


def wanted(
    fit: Fit,
    found: Sequence[Finding],
    groups: Sequence[tuple[str, ...]],
    left: Unexplained,
    laws: Unexplained,
    probability: float,
) -> Wanted | None:
    """Return what would help most, by all findings; ``None`` where the data determine the explanation.

    ``groups``: effects that the data cannot tell apart; ``left`` and ``laws``: what the whole fit leaves, and what the
    known effects leave, which laws may explain; ``probability`` of the explanation.
    """
    if groups:
        frame = next((need for name in groups[0] for need in _frames(found, name)), "")
        if frame or any(is_frame(found, name) for name in groups[0]):
            return Wanted("frame", frame, apart=groups[0][:2])
        if any(f.needs == ("pose",) for f in found if f.name in groups[0]):
            return Wanted("repeats", "pose", apart=groups[0][:2])
        return _pose(fit, groups[0]) or Wanted("range", apart=groups[0][:2])
    if left.flagged:
        return _column(fit, found, left) or Wanted("repeats")
    if laws.flagged:
        return _column(fit, (), laws)  # a law says it all: a column may still tell what it is
    return _pose(fit, ()) if probability < settings.DECIDED else None


def _frames(found: Sequence[Finding], name: str) -> tuple[str, ...]:
    own = next((f.needs for f in found if f.name == name), ())
    return tuple(need for need in own if need.startswith("frames."))


def _pose(fit: Fit, group: Sequence[str]) -> Wanted | None:
    """Return the sample that tells explanations apart best, or another load where samples with it tell clearly more.

    ``None`` where no sample tells enough, or tells other effects apart than those of the group.
    """
    plain = next_samples(fit, settings.TRIAL)
    loads = () if fit.nominal.varies("payload") or not fit.campaign.robot.has_masses else (settings.LOAD,)
    loaded = next_samples(fit, settings.TRIAL, loads=loads) if loads else plain
    least = 0.0 if group else settings.WORTHWHILE
    if _gain(loaded, group) > max(least, settings.PAYS * _gain(plain, group)):
        return Wanted("column", "payload", apart=_apart(loaded, group))
    if _gain(plain, group) < settings.WORTHWHILE:
        return None
    sample = plain.samples[0]
    # when it is measured, and from where the joints come, matters less than where they are
    set_up = {name: v for name, v in sample.conditions.items() if name.partition(".")[0] not in (*CLOCK, *_OF_JOINTS)}
    return Wanted("pose", apart=_apart(plain, group), position=sample.position, conditions=set_up)


def _gain(samples: NextSamples, group: Sequence[str]) -> float:
    return samples.samples[-1].gain if _apart(samples, group) else 0.0


def _apart(samples: NextSamples, group: Sequence[str]) -> tuple[str, ...]:
    """Return the effects that only one of the two explanations has that the first sample tells apart."""
    if not samples.samples or len(samples.samples[0].separates) < 2:
        return ()
    one, other = map(set, samples.samples[0].separates)
    either = tuple(sorted(one ^ other))
    return either if not group or set(either) & set(group) else ()


def _kinds(fit: Fit, left: Unexplained) -> list[str]:
    """Return the kinds of quantity that a remainder follows, as seen from its place."""
    place = next((p.name for p in left.locations), "")
    follows = [name for d in left.depends_on[:1] for name in d.covariate.split(" * ")] or ["none"]
    return [kind_of(name, place, fit.campaign.robot.joint_names) for name in follows]


def _column(fit: Fit, found: Sequence[Finding], left: Unexplained) -> Wanted | None:
    """Return the column that would tell what a remainder is; ``None`` where there is none to record."""
    place = next(((p.kind, p.name) for p in left.locations), ("", ""))
    missing = [f for f in found if f.status == "not_testable" and not is_frame(found, f.name)]
    # what is no column, such as masses in the URDF, cannot be recorded; repeats are not recorded but made
    needed = [n.partition(".")[0] for f in missing for n in f.needs if " " not in n and n != "pose"]
    telling = [column for kind in _kinds(fit, left) for column in TELLS.get(kind, ())]
    for column in (*telling, *sorted(needed, key=lambda c: (c in _OF_JOINTS) != (place[0] == "joint"))):
        if not any(_recorded(fit, column, place)):
            own = column in _OF_JOINTS and place[0] == "joint"
            untested = tuple(f.name for f in missing if column in {n.partition(".")[0] for n in f.needs})
            return Wanted(
                "column",
                f"{column}.{place[1]}" if own else column,
                untested=untested,
                whether=WHETHER.get(column, ""),
                place=next((p.words for p in left.locations[:1]), ""),
                follows=next((d.covariate for d in left.depends_on[:1]), ""),
            )
    return None


def _recorded(fit: Fit, column: str, place: tuple[str, str]) -> Iterator[bool]:
    """Yield for each column of the name whether it was recorded and varies: of a joint, at that joint."""
    whole = f"{column}.{place[1]}" if column in _OF_JOINTS and place[0] == "joint" else ""
    for name in fit.campaign.covariates:
        if name == whole or (not whole and name.partition(".")[0] == column):
            yield fit.nominal.varies(name)
