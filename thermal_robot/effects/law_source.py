"""A law as an effect file of its own, that can be named, kept and installed."""

from __future__ import annotations

from collections.abc import Mapping
from pprint import pformat
from textwrap import fill
from typing import Any

from thermal_robot.arrays import Array


def source(arguments: Mapping[str, Any], what: str, values: Array, name: str) -> str:
    """Text of a Python file with a law as an effect; the fitted values (P,), SI, stand in it as a comment."""
    fields = {k: v for k, v in arguments.items() if k != "name"}
    lines = "\n".join(f"    {key}: Any = {pformat(value, width=100)}" for key, value in fields.items())
    title = "".join(part.capitalize() for part in name.split("_"))
    found = fill(", ".join(f"{v:.4g}" for v in values), 100, initial_indent="    ", subsequent_indent="    ")
    return _SOURCE.format(title=title, name=name, lines=lines, values=found, what=what[:1].upper() + what[1:])


_SOURCE = '''"""{what}.

Found in a campaign by thermal_robot, named by hand.
"""

from dataclasses import dataclass
from typing import Any

from thermal_robot.effects.law import Discovered


@dataclass(frozen=True)
class {title}(Discovered):
    """{what}.

    In the campaign where it was found its values were, in SI:

{values}
    """

    name: Any = "{name}"
{lines}
'''
