"""File format of a corrected model: schema of each key, and messages on a damaged file.

A key is a field of :class:`thermal_robot.correction.CorrectedModel`. A new one is a line of :data:`PARTS`.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign, Settings
from thermal_robot.campaign.names import LABELS, split_name
from thermal_robot.campaign.settings import GRAVITY, settings_kind
from thermal_robot.effects import Effect, gate, library
from thermal_robot.effects.arguments import with_arguments
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.errors import CampaignError, EffectError, RobotError
from thermal_robot.observations import Frames, observe
from thermal_robot.prediction import FileGap, Spread
from thermal_robot.robot import ENDS, Robot, load_robot
from thermal_robot.schema import (
    NOT_NEGATIVE,
    Kind,
    MisfitError,
    below,
    boolean,
    fitted,
    listed,
    mapping,
    matrix,
    number,
    optional,
    plain,
    record,
    text,
    word,
)

SCHEMA = "thermal-robot/model/"
VERSION = 2
"""Version of the file format that is written; version 1, without a checksum, is read, too."""
_LARGEST_FILE = 128 << 20
"""Bytes: largest model file, twice the largest URDF, as that text is a part."""
_SQUARE = 1e-6
"""Largest entry of R Rᵀ − 1 of a rotation matrix: figures of six digits are rounded, of fewer a mistake."""
_FARTHEST = 1e7
"""m: largest component of a translation; an instrument may measure in the coordinates of a country."""
_ROUNDED = 1e-9
"""Largest asymmetry of a covariance by rounding, of its largest entry."""
_LARGEST_VALUE = 1e6
"""Largest value of a parameter, in expected sizes: a joint that is off by a whole turn has 6e3, a base by 100 m 1e6."""
_NO_MODEL = "this is not a model that `diagnose --model` wrote"


@dataclass(frozen=True)
class Part:
    """One key of a model file: how its value is read and written, and whether it may be absent.

    Attributes
    ----------
    kind
        Validator that converts the value in the file into the field of a model.
    write
        Function from the field of a model to the value in the file.
    optional
        Whether the key is left out where the model has ``None``.
    """

    kind: Kind
    write: Callable[[Any], Any] = lambda value: value
    optional: bool = False


def _pose(value: Any, path: str) -> Array:
    """Validate a homogeneous matrix (4, 4): last row 0 0 0 1, a proper rotation, translations within ``_FARTHEST``."""
    pose: Array = matrix((4, 4))(value, path)
    turn = pose[:3, :3]
    if pose[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise MisfitError(f"{path}[3]", pose[3].tolist(), "[0.0, 0.0, 0.0, 1.0], the last row of a pose")
    off = float(np.abs(turn @ turn.T - np.eye(3)).max()) if np.abs(turn).max() < 2.0 else np.inf
    if off > _SQUARE or np.linalg.det(turn) < 0.0:
        wrong = "is a reflection" if off <= _SQUARE else f"is no rotation (it misses one by {off:.2g})"
        raise MisfitError(path, value, "three rows that begin with a rotation matrix", wrong)
    for k in range(3):
        if abs(pose[k, 3]) > _FARTHEST:
            raise MisfitError(f"{path}[{k}][3]", float(pose[k, 3]), f"a number of m, at most {_FARTHEST:g}")
    return pose


def _frames(value: Any, path: str) -> Frames:
    return Frames(**record({"base": _pose, "tool": _pose})(value, path))


def _urdf(value: Any, path: str) -> str:
    """Validate URDF text; names of files are refused."""
    urdf: str = text("the text of a URDF")(value, path)
    if not urdf.lstrip("\ufeff \t\r\n").startswith("<"):
        raise MisfitError(path, value, "the text of a URDF")
    return urdf


def _robot(value: Any, path: str) -> Robot:
    link = text("the name of a link")
    held = record({"urdf": _urdf, **dict.fromkeys(ENDS, link), "gravity": GRAVITY})(value, path)
    try:
        return load_robot(**held)
    except RobotError as error:
        raise MisfitError(path, value, "a robot that can be loaded", f"{error}") from None


def _ends(value: Any, path: str) -> tuple[float, float]:
    low, high = listed(number(), 2, "two numbers, the smaller one first")(value, path)
    if low > high:
        raise MisfitError(path, value, "two numbers, the smaller one first")
    return low, high


def _covariance(value: Any, path: str) -> Array:
    """Validate a covariance matrix: symmetric to rounding, without negative variances."""
    covariance: Array = matrix()(value, path)
    size = float(np.abs(covariance).max(initial=0.0))
    if not size:
        return covariance.reshape(len(covariance), len(covariance))
    if len(set(covariance.shape)) > 1 or np.abs(covariance - covariance.T).max() > _ROUNDED * size:
        raise MisfitError(path, value, "a symmetric matrix")
    if (covariance.diagonal() < 0.0).any():
        raise MisfitError(path, value, "variances that are not negative")
    return covariance


def _spread(value: Any, path: str) -> Spread:
    """Validate the predictive uncertainty of a model file and convert it to a :class:`Spread`."""
    three = listed(NOT_NEGATIVE, 3, "three standard deviations")
    known = {"covariance": _covariance, "beyond": three, "noise": three, "ranges": mapping(_ends)}
    more = {"wider": _covariance, "prior": listed(NOT_NEGATIVE), "between": three}
    more["levels"] = mapping(listed(text("a label")))
    held = record({**known, **more}, may_lack=tuple(more))(value, path)
    rows = len(held["covariance"])
    if len(held.get("wider", held["covariance"])) != rows:
        raise MisfitError(below(path, "wider"), value["wider"], "a matrix of the shape of covariance")
    if len(held.get("prior", ())) > rows:
        raise MisfitError(below(path, "prior"), value["prior"], "a deviation for each parameter of the effects")
    vectors = {
        name: np.array(held[name], dtype=float) for name in ("beyond", "noise", "prior", "between") if name in held
    }
    levels = {name: tuple(own) for name, own in held.get("levels", {}).items()}
    return Spread(**{**held, **vectors, "levels": levels})


def _file_gap(value: Any, path: str) -> FileGap:
    """Validate the expected held-out gap with one kind of robot file and convert it to a :class:`FileGap`."""
    kinds = {"holds": text("what a file holds"), "min_sigma": optional(NOT_NEGATIVE), "shrinkage": number()}
    sizes = {"rms_before": NOT_NEGATIVE, "rms_after": NOT_NEGATIVE, "shrinkage_ci95": _ends}
    return FileGap(**record({**kinds, **sizes, "alone": listed(number())})(value, path))


def _written_robot(robot: Robot) -> dict[str, Any]:
    return {
        "urdf": robot.urdf,
        **{end: getattr(robot, end) for end in ENDS},
        "gravity": np.asarray(robot.gravity).tolist(),
    }


def _written_effects(effects: Sequence[tuple[Effect, Array]]) -> list[dict[str, Any]]:
    return [{"name": e.name, "arguments": gate.arguments(e), "values": np.asarray(v).tolist()} for e, v in effects]


_EFFECT = record({"name": text("the name of an effect"), "arguments": mapping(plain), "values": listed(number())})

PARTS: dict[str, Part] = {
    "robot": Part(_robot, _written_robot),
    "settings": Part(settings_kind, Settings.to_dict),
    "frames": Part(_frames, lambda frames: {"base": frames.base.tolist(), "tool": frames.tool.tolist()}),
    "effects": Part(listed(_EFFECT), _written_effects),
    "measures": Part(word(("position", "pose"))),
    "needs": Part(listed(text("the name of a column")), list),
    "simulated": Part(boolean),
    "last_order": Part(optional(_ends), lambda order: None if order is None else list(order)),
    "spread": Part(_spread, Spread.to_dict, optional=True),
    "files": Part(listed(_file_gap), lambda files: [vars(file) for file in files], optional=True),
}
"""Every key but ``schema`` and ``checksum``; a key of a model's field that may be absent, or empty, is ``optional``."""


def written(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Convert the fields of a model to plain values for JSON, with the version of the format and a checksum."""
    kept = {key: part for key, part in PARTS.items() if not (part.optional and fields[key] in (None, ()))}
    body = {key: part.write(fields[key]) for key, part in kept.items()}
    found = {"schema": f"{SCHEMA}{VERSION}", **body}
    return {"schema": found["schema"], "checksum": checksum(found), **body}


def checksum(document: Mapping[str, Any]) -> str:
    """SHA-256 of a document without its key ``checksum``, independent of layout and number format."""
    rest = {key: value for key, value in document.items() if key != "checksum"}
    return hashlib.sha256(json.dumps(_spelt(rest), sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _spelt(value: Any) -> Any:
    """Convert all numbers in plain values to floats, and −0.0 to 0.0, so that 1 and 1.0 have one checksum."""
    if isinstance(value, Mapping):
        return {key: _spelt(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_spelt(each) for each in value]
    # and 0.0 of what was −0.0
    return float(value) + 0.0 if isinstance(value, (int, float)) and not isinstance(value, bool) else value


def fields_of(document: Any, own: Sequence[Effect], file: str) -> dict[str, Any]:
    """Validate the document of a model file and convert it to the fields of a model; the inverse of :func:`written`.

    Parameters
    ----------
    document
        The plain values.
    own
        The user's own effects that it may hold.
    file
        What to call it in messages.

    Raises
    ------
    CampaignError
        Naming the place of a value that is wrong; or if all are possible, but the checksum differs.
    EffectError
        If it holds an effect that is not installed.
    """
    version = _version(document, file)
    body = {key: value for key, value in document.items() if key != "schema"}
    may_lack = [key for key, part in PARTS.items() if part.optional]
    kinds = {key: part.kind for key, part in PARTS.items()}
    if version > 1:
        kinds["checksum"] = text("a checksum")
    fields: dict[str, Any] = fitted(record(kinds, may_lack), body, file)
    fields["effects"] = _restored(fields["effects"], own, file)
    _require_fit(fields, file)
    if version > 1 and fields.pop("checksum") != checksum(document):
        raise CampaignError(file, "was changed after it was written: every value is possible, but the checksum differs")
    return fields


def _version(document: Any, file: str) -> int:
    found = document.get("schema") if isinstance(document, Mapping) else None
    number_of = re.fullmatch(rf"{SCHEMA}([1-9]\d{{0,8}})", found) if isinstance(found, str) else None
    if number_of is None:
        raise CampaignError(file, _NO_MODEL, key="schema", found=repr(found), expected=repr(f"{SCHEMA}{VERSION}"))
    version = int(number_of[1])
    if version > VERSION:
        raise CampaignError(
            file,
            f"was written by a newer version of thermal-robot, as version {version} of the file; "
            f"this one reads up to version {VERSION}",
            key="schema",
        )
    return version


def _restored(entries: Sequence[dict[str, Any]], own: Sequence[Effect], file: str) -> tuple[tuple[Effect, Array], ...]:
    """Build the effects of a file from name and arguments, with their (P,) values; an error for one not installed."""
    known = {**library(), **{effect.name: effect for effect in own}}
    held = []
    for k, entry in enumerate(entries):
        name, path = entry["name"], f"effects[{k}]"
        kind = Discovered if name.startswith(PREFIX) else type(known.get(name))
        if not issubclass(kind, Effect):
            raise EffectError(f"{file}, {path}.name: the model holds the effect {name!r}, which is not installed here")
        effect = fitted(partial(with_arguments, kind), entry["arguments"], file, below(path, "arguments"))
        if effect.name != name:
            raise CampaignError(file, f"is {effect.name!r}", key=f"{path}.arguments.name", expected=repr(name))
        held.append((effect, np.array(entry["values"], dtype=float)))
    return tuple(held)


def _require_fit(fields: Mapping[str, Any], file: str) -> None:
    """Refuse values that fit the schema but not each other: unknown joints, wrong parameter counts, missing columns."""
    robot, settings = fields["robot"], fields["settings"]
    for joint in settings.gears:
        if joint not in robot.joint_names:
            raise CampaignError(file, "the chain has no such joint", key=below("settings.gears", joint))
    seen = observe(_any_rows(fields), fields["frames"])
    for k, (effect, values) in enumerate(fields["effects"]):
        if not type(effect).__module__.startswith("thermal_robot."):
            continue  # an effect of the user's own may ask more of the rows; it is asked when it predicts
        try:
            parameters = gate.declared(effect, seen)
        except EffectError as error:
            raise EffectError(f"{file}, effects[{k}]: {error}") from None
        if len(parameters) != len(values):
            raise CampaignError(
                file,
                f"are {len(values)} values",
                key=f"effects[{k}].values",
                expected=f"one for each of the {len(parameters)} parameters that {effect.name!r} has on this robot",
            )
        if any(not parameter.responses for parameter in parameters):
            lacking = ", ".join(gate.missing(effect, seen))
            raise CampaignError(
                file, f"lacks {lacking or 'a column'}", key="needs", expected=f"what {effect.name!r} reads"
            )
        for p, (parameter, value) in enumerate(zip(parameters, values, strict=True)):
            if abs(value) > _LARGEST_VALUE * parameter.size:
                raise CampaignError(
                    file,
                    f"is {value:g}",
                    key=f"effects[{k}].values[{p}]",
                    expected=f"a value of {parameter.name!r}, which is about {parameter.size:g} {parameter.unit}",
                )


def _any_rows(fields: Mapping[str, Any]) -> Campaign:
    """Three dummy rows with the columns that a model needs, to count the parameters of its effects."""
    robot, settings = fields["robot"], fields["settings"]
    lower, upper = np.maximum(robot.lower, -1.0), np.minimum(robot.upper, 1.0)
    rows = {name: np.arange(3.0) - (split_name(name)[0] == "approach") for name in fields["needs"]}
    return Campaign(
        name="any rows",
        robot=robot,
        q=lower + (upper - lower) * np.array([[0.3], [0.5], [0.8]]),
        covariates=rows,
        simulated_position=np.zeros((3, 3)) if fields["simulated"] else None,
        tool_known=settings.tool_known,
        payload_com=np.array(settings.payload_com),
        reference_temperature=settings.reference_temperature,
        labels={label: np.array(["1", "2", "3"]) for label in LABELS},
        gears=settings.gears,
        units=settings.units,
    )


def read(path: Path) -> Any:
    """Read and parse the JSON of a model file.

    Raises
    ------
    CampaignError
        If it cannot be read, is larger than any model, or holds no JSON.
    """
    file = str(path)
    try:
        if path.exists() and not path.is_file():
            raise CampaignError(file, "is a folder, a pipe or a device", expected="a model file")
        if path.stat().st_size > _LARGEST_FILE:
            raise CampaignError(file, f"is larger than any model ({_LARGEST_FILE >> 20} MiB)")
        content = path.read_bytes()
    except FileNotFoundError:
        raise CampaignError(file, "no such file") from None
    except (OSError, ValueError) as error:  # Python asks for no file whose name holds NUL
        raise CampaignError(file, "cannot be read", found=getattr(error, "strerror", None) or str(error)) from None
    try:
        return json.loads(content.decode("utf-8-sig"), object_pairs_hook=_once, parse_int=_whole)
    except json.JSONDecodeError as error:
        found = f"no JSON ({error.msg})" if content.strip() else "an empty file"
        raise CampaignError(file, _NO_MODEL, row=error.lineno, found=found) from None
    except UnicodeDecodeError:
        raise CampaignError(file, _NO_MODEL, found="no text in UTF-8") from None
    except RecursionError:
        raise CampaignError(file, _NO_MODEL, found="lists in lists too deep to read") from None
    except MisfitError as error:
        raise CampaignError(file, error.problem, key=error.path, expected=error.expected) from None


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make a dictionary of the pairs of a JSON object; :class:`MisfitError` if a key stands twice."""
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise MisfitError(below("", key), value, "every key once", "stands twice in one object")
        found[key] = value
    return found


def _whole(digits: str) -> float:
    """Parse a whole number of JSON; 300 digits or more become a float, which validation refuses later."""
    return int(digits) if len(digits) < 300 else float(digits)
