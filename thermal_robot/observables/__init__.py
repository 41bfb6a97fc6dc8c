"""What a row measures: each kind in a file of its own, position and pose among them."""

from thermal_robot.observables.catalogue import (
    KINDS,
    Sight,
    components,
    figures_of_a_row,
    instrument_rows,
    kinds_of,
    of_model,
    seen_components,
    tool_width,
)
from thermal_robot.observables.observable import Artefact, Observable, Seen

__all__ = [
    "KINDS",
    "Artefact",
    "Observable",
    "Seen",
    "Sight",
    "components",
    "figures_of_a_row",
    "instrument_rows",
    "kinds_of",
    "of_model",
    "seen_components",
    "tool_width",
]
