"""What only a fleet needs, loaded when it is used: Parquet and Dask, the extra ``fleet``."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from thermal_robot.errors import ThermalRobotError


def needed(module: str) -> Any:
    """Return a module of the extra ``fleet``.

    Raises
    ------
    ThermalRobotError
        If it is not installed; says how to.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ThermalRobotError(
            f"a fleet needs {package}, which cannot be loaded ({error}); pip install 'thermal-robot[fleet]'"
        ) from error
