"""The contract of a fault of the data: what it is called, what mends it, and the tables in which it is mended."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from thermal_robot.diagnosis.data_faults.readings import Readings, Rows

Repair = Callable[[Readings, Rows], Readings]
"""Readings, and the (N,) rows that the fault struck; returns the readings mended in these rows."""


@dataclass(frozen=True)
class Proposal:
    """One fault that may have struck, and the readings without it.

    Attributes
    ----------
    kind
        What kind of fault.
    place
        Where it struck, in words: joints, columns, how many rows; several are listed where data cannot tell them.
    repair
        Mends it.
    joints
        Those that are turned round, where that is what is wrong: a larger set that fits no better says nothing more.
    """

    kind: Kind
    place: str
    repair: Repair
    joints: frozenset[str] = frozenset()


Fault = tuple[Proposal, ...]
"""What is wrong with a table: nothing, one fault, or two at once, mended one after the other."""


def repaired(fault: Fault, readings: Readings, struck: Rows) -> Readings:
    """Return the readings with one repair after the other in the rows struck; a row must stay known in each."""
    for proposal in fault:
        readings = proposal.repair(readings, struck)
    return readings


@dataclass(frozen=True)
class Offsets:
    """Faults of one kind that differ by a number: which to try first, and the fault of each.

    Attributes
    ----------
    tried
        Numbers, in order, between which the best is looked for.
    of
        Returns the proposal of a number.
    """

    tried: tuple[float, ...]
    of: Callable[[float], Proposal]


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes
    ----------
    name
        Short, for those who count kinds.
    says
        What is wrong, ``{}`` standing for the place.
    remedy
        What to do about it.
    proposals
        Yields place and repair of each fault of this kind that readings may have, and the joints turned round, if any.
    offsets
        Yields families of such faults that differ by a number.
    """

    name: str
    says: str
    remedy: str
    proposals: Callable[[Readings], Iterable[tuple[str, Repair] | tuple[str, Repair, frozenset[str]]]] = lambda _: ()
    offsets: Callable[[Readings], Iterable[tuple[tuple[float, ...], Callable[[float], tuple[str, Repair]]]]] = (
        lambda _: ()
    )

    def proposed(self, readings: Readings) -> Iterator[Proposal]:
        """Yield the faults of this kind that readings may have."""
        for found in self.proposals(readings):
            yield Proposal(self, *found)

    def families(self, readings: Readings) -> Iterator[Offsets]:
        """Yield the families of such faults."""
        for tried, of in self.offsets(readings):
            yield Offsets(tried, lambda number, of=of: Proposal(self, *of(number)))  # type: ignore[misc]
