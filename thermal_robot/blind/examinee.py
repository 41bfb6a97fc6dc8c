"""Subprocess that diagnoses the campaigns of a trial without access to the answers.

``python -m thermal_robot.blind.examinee DIRECTORY`` reads one request a line, as JSON, and writes one reply a line::

    {"folder": "...", "without": ["backlash"], "only": []}
    {"said": {diagnosis} | null, "predicted": [[x, y, z], ...] | null, "refitted": {"drift+backlash": [[x, y, z], ...]},
     "seconds": 0.4, "error": null | "..."}

A request for several campaigns has ``"asks"``, too (:data:`thermal_robot.blind.cases.ASKS`); what is said is then a
comparison, a robot over time or a fleet, and nothing is predicted.

Before the first it writes ``{"ready": true}``. ``DIRECTORY`` is that of the trial.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.blind.cases import LISTED
from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.datasets import demo_directory
from thermal_robot.diagnosis import Diagnosis, diagnose
from thermal_robot.effects import library
from thermal_robot.fleet.compare import compare
from thermal_robot.fleet.listed import Listed, campaigns
from thermal_robot.fleet.many import TABLE, diagnosed
from thermal_robot.fleet.rows import write_rows
from thermal_robot.fleet.summary import summarise
from thermal_robot.fleet.wear import wear
from thermal_robot.inference.algebra import equations_of, ridge
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.registration import register
from thermal_robot.observations import Observations, observe

Plain = dict[str, Any]
CAMPAIGN, FRESH, MODEL = "campaign.toml", "fresh.csv", "model.json"
MOST = 6
"""Largest number of effects of which every subset is fitted: 64 fits."""
_ROUNDS = 3  # after which noise and fit agree to a per cent


def refitted(found: Diagnosis, campaign: Campaign, samples: Campaign) -> dict[str, Array]:
    """Predict samples with every subset of a model's effects, frames and effects refitted for each.

    Each fit is a ridge regression, linear about the nominal robot, on the rows that were not set aside, with the
    settings of the whole diagnosis (time constants, places, quantities). The prior of an effect's parameters has the
    size that they have in the diagnosis; the residual of a subset counts as noise, of positions and of orientations
    apart. A diagnosis defines its held-out shares in the same way. For all effects the model itself predicts.

    Returns (M, 3) positions in the measurement frame, m, by names joined with ``+``; empty where there are more than
    :data:`MOST` effects, or none.
    """
    model = found.model
    if not 0 < len(model.effects) <= MOST:
        return {}
    kept = ~np.isin(campaign.rows, found.rows.rows[found.rows.outliers])
    frames = register(campaign, kept)
    given = observe(campaign, frames)
    asked = observe(_measured(samples, model), frames)
    columns, fresh, prior, ends = _design(model, given, asked)
    columns, gap = columns[kept], given.gap[kept]
    noise = np.maximum(_level(found.rows.remainder[kept]), 1e-9)
    nominal, base = asked.predicted_position, frames.base[:3, :3]
    predicted = {"+".join(effect.name for effect, _ in model.effects): model.prediction(samples)[0]}
    for size in range(len(model.effects)):
        for chosen in combinations(range(len(model.effects)), size):
            effects = [np.arange(ends[k], ends[k + 1]) for k in chosen]
            used = np.concatenate([np.arange(ends[0]), *effects])
            fitted = _fitted(columns[:, :, used], gap, noise, prior[used[ends[0] :] - ends[0]])
            names = "+".join(model.effects[k][0].name for k in chosen)
            predicted[names] = nominal + fresh[:, :, used] @ fitted @ base.T
    return predicted


def _measured(samples: Campaign, model: CorrectedModel) -> Campaign:
    """Return the samples with dummy measurements, so that their design matrix has the columns of the campaign's."""
    count = samples.samples
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)) if model.measures == "pose" else None
    read = {name: values for name, values in samples.covariates.items() if name in model.needs}
    return replace(samples, covariates=read, position=np.zeros((count, 3)), orientation=turned)


def _design(
    model: CorrectedModel, given: Observations, asked: Observations
) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Design matrices (N, m, K) and (M, 3, K), prior precisions of the effects' columns, and the blocks' end indices.

    The blocks are the frames and each effect. The prior standard deviation of a parameter is its expected size times
    the rms of its effect's fitted parameters over their expected sizes.
    """
    here, there, prior = [frame_columns(given)[0]], [frame_columns(asked)[0]], [np.zeros(0)]
    for effect, values in model.effects:
        own = block(given, effect)
        here.append(own.columns)
        there.append(block(asked, effect).columns)
        scale = np.sqrt(np.mean((values / own.sizes) ** 2)) if len(values) else 1.0
        prior.append((own.sizes * max(scale, 1e-6)) ** -2.0)
    ends = np.cumsum([part.shape[2] for part in here])
    return np.concatenate(here, axis=2), np.concatenate(there, axis=2)[:, :3], np.concatenate(prior), ends


def _level(left: Array) -> Array:
    """Root mean square (m/3,) per axis of residuals (N, m): of positions, m, then of orientations, rad."""
    return np.asarray(np.sqrt((left.reshape(len(left), -1, 3) ** 2).mean(axis=(0, 2))))


def _fitted(columns: Array, gap: Array, noise: Array, prior: Array) -> Array:
    """Coefficients (K,) by iteratively reweighted ridge regression.

    The weights of positions and of orientations follow from the rms of their residuals, at least the ``noise`` (m/3,),
    m and rad. (N, m, K) columns and (N, m) gap; ``prior`` is the precision of the last columns, those of effects.
    """
    level = np.maximum(_level(gap), noise)
    for _ in range(_ROUNDS):
        each = np.repeat(level, 3)
        stack = np.column_stack([equations_of(columns / each[:, None]), (gap / each).ravel()])
        fitted = ridge(stack.T @ stack, columns.shape[2] - len(prior), prior)
        level = np.maximum(_level(gap - columns @ fitted), noise)
    return fitted


class Fence:
    """Audit hook that denies access to all files of the trial's directory but one folder.

    It keeps honest code honest: a compiled library that opens files past Python is not seen. The seal does not depend
    on it.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = Path(os.path.realpath(directory))
        self._folder = Path()

    def allow(self, folder: Path) -> None:
        """Grant access to this folder, and revoke that to the one before."""
        self._folder = Path(os.path.realpath(folder))

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Raise PermissionError if an event opens or lists a path in the directory but outside the allowed folder."""
        if event not in ("open", "os.listdir", "os.scandir") or not isinstance(arguments[0], (str, bytes, os.PathLike)):
            return
        # links are followed: one inside the folder could lead out of it
        path = Path(os.path.realpath(os.fsdecode(arguments[0])))
        if path.is_relative_to(self._directory) and not path.is_relative_to(self._folder):
            raise PermissionError(f"{path} is no business of the one who is examined")


def answer(request: dict[str, Any]) -> Plain:
    """Diagnose the requested campaign(s) and predict a single one's fresh samples; an exception becomes the error."""
    folder, asks = Path(request["folder"]), request.get("asks", "diagnosis")
    reply: Plain = {"said": None, "predicted": None, "refitted": {}, "seconds": None, "error": None}
    at, start = asks, time.perf_counter()
    try:
        if asks in ANSWERS:
            reply["said"] = ANSWERS[asks](campaigns(folder / LISTED), request["only"] or None)
            reply["seconds"] = time.perf_counter() - start
            return reply
        # what the library does not have need not be taken out of it
        without = [name for name in request["without"] if name in library()]
        found = diagnose(folder / CAMPAIGN, only=request["only"] or None, without=without)
        reply["seconds"] = time.perf_counter() - start
        reply["said"] = found.to_dict()
        at = "prediction"
        if (folder / FRESH).is_file():
            # with the model as a user would have it: saved and loaded
            found.model.save(folder / MODEL)
            model = CorrectedModel.load(folder / MODEL)
            position, _ = model.prediction(model.samples(folder / FRESH))[:2]
            if not np.all(np.isfinite(position)):
                raise ValueError("a predicted position is not a number")
            reply["predicted"] = position.round(9).tolist()  # to a nanometre
            at = "refit of its parts"
            parts = refitted(found, read_campaign(folder / CAMPAIGN), found.model.samples(folder / FRESH))
            reply["refitted"] = {names: position.round(9).tolist() for names, position in parts.items()}
    except Exception as error:
        reply["error"] = f"the {at} failed: {type(error).__name__}: {error}"
    return reply


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer JSON requests on standard input, one a line, until it ends; always returns 0."""
    (directory,) = sys.argv[1:] if arguments is None else arguments
    # whatever a library prints goes to stderr, C code included: the replies have a channel of their own
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as replies:
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        fence = Fence(Path(directory))
        sys.addaudithook(fence)
        # the first diagnosis of a process also pays for imports; none of the trial's is to be the first
        diagnose(demo_directory())
        print(json.dumps({"ready": True}), file=replies, flush=True)
        for line in sys.stdin:
            request = json.loads(line)
            fence.allow(Path(request["folder"]))
            print(json.dumps(answer(request)), file=replies, flush=True)
    return 0


def comparison(listed: Listed, only: Sequence[str] | None) -> Plain:
    """Compare listed campaigns; returns the comparison as plain values, format ``thermal-robot/comparison/1``."""
    names = [name for name, _ in listed.campaigns]
    return compare(*map(listed.folder, names), names=names, only=only).to_dict()


def followed(listed: Listed, only: Sequence[str] | None) -> Plain:
    """Diagnose a robot's change over time from dated campaigns; returns plain values, ``thermal-robot/wear/1``."""
    date = listed.names.index("date")
    return wear([(labels[date], listed.folder(name)) for name, labels in listed.campaigns], effects=only).to_dict()


def fleet(listed: Listed, only: Sequence[str] | None) -> Plain:
    """Diagnose the robots of a fleet; returns the summary as plain values, format ``thermal-robot/fleet/1``.

    It is what :func:`~thermal_robot.diagnose_many` does, but within this process: those of Dask would stand outside
    the fence, and outlive an examinee that is ended.
    """
    table = listed.root / TABLE

    def rows() -> Iterator[Plain]:
        for name, labels in listed.campaigns:
            named = {"campaign": name, **dict(zip(listed.names, labels, strict=True))}
            yield from ({**named, **row} for row in diagnosed(listed.folder(name), only or (), ())[0])

    write_rows(table, listed.names, rows())
    return summarise(table, listed.names).to_dict()


ANSWERS = {"comparison": comparison, "wear": followed, "fleet": fleet}
"""Functions that answer requests for several campaigns, by :data:`thermal_robot.blind.cases.ASKS`."""


if __name__ == "__main__":
    sys.exit(main())
