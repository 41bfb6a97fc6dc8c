"""Names of discovered laws for the reader: numbered from 1 in the order of their shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from thermal_robot.diagnosis.held_out import Shrinkage
from thermal_robot.effects import Effect
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.inference.discover import Discovery
from thermal_robot.inference.fit import Fit


def numbered(fit: Fit, shrinkage: Shrinkage, laws: Sequence[Discovery]) -> tuple[Fit, Shrinkage, tuple[Discovery, ...]]:
    """Name the laws of a fit anew wherever their names stand, those that did not last after the others.

    Parameters
    ----------
    fit, laws
        The fit and its laws.
    shrinkage
        Its held-out shares: the largest is of ``discovered.1``.
    """
    held = {effect.name for effect, _ in fit.effects}
    names = [name for name in dict.fromkeys(fit.families) if name.startswith(PREFIX)]
    names.sort(key=lambda name: (name not in held, -shrinkage.shares.get(name, (0.0,))[0]))
    new = {name: f"{PREFIX}{number}" for number, name in enumerate(names, 1)}

    def named(effect: Effect) -> Effect:
        return replace(effect, name=new[effect.name]) if isinstance(effect, Discovered) else effect

    linear = fit.explanation.linear
    blocks = tuple(replace(block, effect=named(block.effect)) for block in linear.blocks)
    fit = replace(
        fit,
        explanation=replace(fit.explanation, linear=replace(linear, blocks=blocks)),
        effects=tuple((named(effect), values) for effect, values in fit.effects),
        families=tuple(new.get(name, name) for name in fit.families),
        variants={new.get(name, name): tuple(map(named, own)) for name, own in fit.variants.items()},
    )
    shares = {new.get(name, name): share for name, share in shrinkage.shares.items()}
    again = tuple(replace(found, law=replace(found.law, name=new[found.law.name])) for found in laws)
    return fit, replace(shrinkage, shares=shares), again
