"""Errors that the program raises on purpose: one root class, each carrying the offending data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

_LONGEST = 1000  # characters of a message: a terminal shows it on a dozen lines


class ThermalRobotError(Exception):
    """Root of the errors that a user can fix; each prints as one line.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> try:
    ...     tr.read_campaign("no_such_folder")
    ... except tr.ThermalRobotError as error:
    ...     print(error)
    no_such_folder...
    """

    def __str__(self) -> str:
        # a name or a value may be a million characters long, or of bytes that are no text
        line = " ".join(Exception.__str__(self).split()).encode(errors="backslashreplace").decode()
        line = "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in line)
        half = _LONGEST // 2 - 2
        return line if len(line) <= _LONGEST else f"{line[:half]} … {line[-half:]}"

    def __reduce__(self) -> tuple[Callable[..., ThermalRobotError], tuple[object, ...]]:
        # errors cross processes; their constructors take more than the message
        return _again, (type(self), self.args, self.__dict__)


def _again(kind: type[ThermalRobotError], args: tuple[object, ...], fields: dict[str, object]) -> ThermalRobotError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(fields)
    return error


class RobotError(ThermalRobotError):
    """Error: a robot description, or an argument that refers to it, cannot be used.

    Parameters
    ----------
    message
        One plain sentence.
    name
        The file, frame or joint that offends.
    candidates
        Names that would have been accepted, nearest first.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> try:
    ...     tr.load_robot("builtin:rv_m2", "tol0")
    ... except tr.RobotError as error:
    ...     print(error.candidates[0])
    tool0
    """

    def __init__(self, message: str, *, name: str = "", candidates: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.name = name
        self.candidates = tuple(candidates)


class CampaignError(ThermalRobotError):
    """Error: a file or argument cannot be used; names file, row and column, what was found and what was expected.

    Parameters
    ----------
    file
        Path of the offending file as the user gave it.
    problem
        One plain sentence without the location.
    row
        Row in the file, counted as a text editor does (the header is row 1); ``None`` for the whole file.
    column
        Column or TOML key; ``None`` for the whole row.
    key
        Path of a value in a file that is no table, such as ``effects[2].values[3]``.
    found, expected
        Value found, and value expected.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> try:
    ...     tr.demo_campaign().drop_covariate("humidity")
    ... except tr.CampaignError as error:
    ...     print(error.problem, error.column)
    no such covariate humidity
    """

    def __init__(
        self,
        file: str,
        problem: str,
        *,
        row: int | None = None,
        column: str | None = None,
        key: str | None = None,
        found: str | None = None,
        expected: str | None = None,
    ) -> None:
        self.file, self.problem, self.row, self.column, self.key = file, problem, row, column, key
        self.found, self.expected = found, expected
        place = file + (f", row {row}" if row is not None else "") + (f", column {column!r}" if column else "")
        place += f", {key}" if key else ""
        detail = (f"; found {found}" if found is not None else "") + (
            f", expected {expected}" if expected is not None else ""
        )
        super().__init__(f"{place}: {problem}{detail}")


class EffectError(ThermalRobotError):
    """Error: an effect breaks the contract of :class:`~thermal_robot.Effect`, or no effect has the name asked for.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> try:
    ...     tr.diagnose(tr.demo_campaign(), only=["backlsh"])
    ... except tr.EffectError as error:
    ...     print(error)
    no effect is named 'backlsh'; did you mean 'backlash'?
    """


class OwnEffectError(EffectError):
    """Error: one of the program's own effects breaks the contract of effects; exit status 1."""

    def __init__(self, message: str) -> None:
        super().__init__(ours(message))


class UnknownEffectError(EffectError, KeyError):
    """Error, a ``KeyError`` too: no candidate effect of a diagnosis has the name asked for."""


class EstimationError(ThermalRobotError):
    """Error: the data do not determine the estimate, as with too few poses.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> try:
    ...     tr.diagnose(tr.demo_campaign().take([0, 1]))
    ... except tr.EstimationError as error:
    ...     print(error)
    2 different poses are too few: 9 unknowns of the frames need at least 7 of them, and effects many more
    """


def ours(what: str) -> str:
    """Message that ``what`` is a fault of the program itself, with its version and what to send to its authors."""
    from importlib.metadata import version

    program = f"thermal_robot {version('thermal-robot')}"
    return (
        f"{what}; this is an error of {program}, not of your campaign: please send this line to its "
        "authors, with the command, campaign.toml, the table and the URDF, or as few rows of it as bring the line back"
    )


class SealError(ThermalRobotError):
    """Error: the sealed answers of a blind trial cannot be read or do not match the hash published beforehand."""


class Note(UserWarning):
    """Warning about something that was left out; the command line prints it in one line."""


def require(call: str, given: object, kinds: tuple[Any, ...], expected: str) -> None:
    """Raise an error if an argument is not an instance of one of the ``kinds``, naming what is expected.

    Raises
    ------
    CampaignError
        Naming the call, the type that was found, and what is expected.
    """
    if not isinstance(given, kinds):
        raise CampaignError(call, "cannot take this", found=f"{type(given).__name__}", expected=expected)
