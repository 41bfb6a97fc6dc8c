"""A fault of the user's own, from a file of his."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.unlisted import UNLISTED
from thermal_robot.errors import EffectError


def load(where: str) -> Fault:
    """Load a :class:`Fault` that a Python file defines.

    Parameters
    ----------
    where
        ``file.py:NAME``: the file, and the name of the fault, or of something that returns it when called.

    Raises
    ------
    EffectError
        If there is no such file or name, or if it is no fault.
    """
    file, _, name = where.rpartition(":")
    path = Path(file)
    if not path.is_file():
        raise EffectError(f"fault {where!r}: there is no file {file!r}; expected file.py:NAME")
    spec = importlib.util.spec_from_file_location(f"fault_of_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise EffectError(f"fault {where!r}: {file!r} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
        found = getattr(module, name)
        fault = found() if callable(found) and not isinstance(found, Fault) else found
    except Exception as error:
        raise EffectError(f"fault {where!r}: {type(error).__name__}: {error}") from error
    if not isinstance(fault, Fault):
        raise EffectError(f"fault {where!r} is a {type(fault).__name__}, not a Fault")
    return fault


def known(name: str, own: str = "") -> Fault:
    """Return a fault by name: the user's own where one is given, else one of the trial's."""
    return load(own) if own else {**FAULTS, **UNLISTED}[name]
