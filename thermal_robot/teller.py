"""The port through which a diagnosis is put into words and drawn: who does so is registered here, and loaded late."""

from __future__ import annotations

from typing import Any

_tellers: list[Any] = []


def told_by(teller: Any) -> None:
    """Register who puts every diagnosis into words and figures from now on.

    Parameters
    ----------
    teller
        A module or an object with the methods of :class:`thermal_robot.diagnosis.result.Teller`.
    """
    _tellers[:] = [teller]


def registered() -> Any:
    """Return who was registered last.

    Raises
    ------
    RuntimeError
        If nobody was.
    """
    if not _tellers:
        raise RuntimeError("nobody can tell a diagnosis: import thermal_robot, or call told_by")
    return _tellers[0]
