"""One process that judges trials until it dies: asked by lines of JSON, it answers by lines of JSON."""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import signal
import sys
import traceback
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

MEMORY = 2 * 2**30
"""Bytes beyond what the program needs by itself."""
FILES = 2**28
"""Bytes of one file that is written."""
LONGEST = 1000
"""Characters of one sentence: more is a table that was printed."""


def judged(target, folder: Path) -> tuple[str, str, str]:
    """Return the outcome of a trial, what was said, and where it happened."""
    from thermal_robot.errors import OwnEffectError, ThermalRobotError

    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            target.check(folder)
        except OwnEffectError as error:
            return "traceback", str(error), _place(error)
        except ThermalRobotError as error:
            said = str(error)
            plain = said and len(said) <= LONGEST and not any(c < " " or c == "\x7f" for c in said)
            # the same campaign written otherwise must be read
            outcome = "wrong" if target.name == "same" else "refused" if plain else "unclear"
            return outcome, said, _place(error)
        except AssertionError as error:
            return "wrong", str(error), _place(error)
        except MemoryError as error:
            return "memory", "MemoryError", _place(error)
        except Exception as error:
            return "traceback", f"{type(error).__name__}: {error}", _place(error)
    kinds = (RuntimeWarning, DeprecationWarning, FutureWarning, UserWarning)
    noise = [warning for warning in heard if issubclass(warning.category, kinds)]
    if noise:
        return "warning", str(noise[0].message), f"{Path(noise[0].filename).name}:{noise[0].lineno}"
    return "right", "", ""


def _place(error: BaseException) -> str:
    """The innermost line of the program."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if f"{os.sep}thermal_robot{os.sep}" in f.filename] or frames
    return f"{Path(own[-1].filename).name}:{own[-1].lineno}"


def main() -> None:
    """Answer until the input ends; a signal of spent CPU kills, and its stack goes to the standard error."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    faulthandler.enable()
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    faulthandler.register(signal.SIGPROF, chain=True)
    from fuzz.targets import ITSELF, TARGETS

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILES, FILES))
    answers.write("ready\n")
    answers.flush()
    for line in sys.stdin:
        asked = json.loads(line)
        target = {**TARGETS, ITSELF.name: ITSELF}[asked["target"]]
        signal.setitimer(signal.ITIMER_PROF, target.seconds)
        answer = judged(target, Path(asked["folder"]))
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
