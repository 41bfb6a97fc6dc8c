"""Where the file of a mesh is that a URDF names."""

from __future__ import annotations

import os
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

PACKAGE, FILE = "package://", "file://"
SEARCHED = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")
"""Variables of the environment in which ROS lists its packages, or the folders above them."""


def find_mesh(named: str, folder: Path) -> Path | None:
    """Return the file of a mesh; nothing is fetched from another machine.

    Parameters
    ----------
    named
        As in the URDF: a path, absolute or from the folder of the URDF, ``file://`` and a path, or ``package://``,
        the name of a package and a path in it. A package is looked for in the folders above the URDF, then where
        ROS says that its packages are, then where this Python keeps those that were installed as wheels, such as
        example-robot-data.
    folder
        Of the URDF.

    Returns
    -------
    Path or None
        ``None`` where there is no such file.
    """
    return next((path for path in _places(named, folder) if path.is_file()), None)


def _places(named: str, folder: Path) -> Iterator[Path]:
    if named.startswith(FILE):
        yield Path(unquote(named.removeprefix(FILE)))
    elif named.startswith(PACKAGE):
        package, _, rest = named.removeprefix(PACKAGE).partition("/")
        for above in (folder.resolve(), *folder.resolve().parents):
            yield above / package / rest
            if above.name == package:
                yield above / rest
        # a URDF that was moved out of its package still stands beside its meshes
        yield folder / rest
        for variable in SEARCHED:
            for listed in filter(None, os.environ.get(variable, "").split(os.pathsep)):
                yield Path(listed) / package / rest
                yield Path(listed) / "share" / package / rest
                if Path(listed).name == package:
                    yield Path(listed) / rest
        for prefix in (Path(sysconfig.get_path("purelib")) / "cmeel.prefix", Path(sysconfig.get_path("data"))):
            yield prefix / "share" / package / rest
    elif "://" not in named:
        yield folder / named
