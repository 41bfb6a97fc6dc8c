"""Run of a trial: generate campaigns, seal the answers, diagnose, open the seal, join."""

from __future__ import annotations

import hashlib
import hmac
import json
import math
import secrets
import shutil
import signal
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import closing
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermal_robot.blind.cases import ASKS, Case
from thermal_robot.blind.score import shares
from thermal_robot.blind.supervise import examine
from thermal_robot.errors import SealError, ThermalRobotError
from thermal_robot.files import write_bytes, write_text

if TYPE_CHECKING:
    from thermal_robot.blind.real import RealCase

KEY_BYTES = 32


def seal(answers: dict[str, Any], path: Path, key: bytes) -> str:
    """Encrypt answers with a stream cipher, and return their commitment: SHA-256 of key and text, in hexadecimal.

    The text, :func:`canonical` JSON, is XORed with a keystream that SHAKE-256 makes of the 32 random bytes of the key.
    The key stays in the memory of the process that made the answers: without it the file tells only its length. A key
    must serve once, since two texts under one keystream would betray their difference. The commitment says that the
    answers were fixed when it was told: nobody finds another text, or another key, with the same hash.
    """
    if len(key) != KEY_BYTES:
        raise ValueError(f"a key has {KEY_BYTES} bytes, not {len(key)}")
    plain = canonical(answers)
    write_bytes(path, _cipher(plain, key))
    return _commitment(plain, key)


def open_seal(path: Path, key: bytes, commitment: str) -> dict[str, Any]:
    """Decrypt the answers of :func:`seal` and verify the commitment.

    Raises
    ------
    SealError
        If the file was altered or is missing, or key or commitment are not its own.
    """
    try:
        plain = _cipher(path.read_bytes(), key)
    except OSError as error:
        raise SealError(f"{path}: the sealed answers cannot be read: {error.strerror}") from None
    if not hmac.compare_digest(_commitment(plain, key), commitment):
        raise SealError(
            f"{path}: these are not the answers that were sealed: the commitment {commitment} is not theirs"
        )
    return dict(json.loads(plain))


def canonical(value: Any) -> bytes:
    """Canonical JSON of plain values: sorted keys, no spaces, ASCII, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode("ascii")


def _cipher(text: bytes, key: bytes) -> bytes:
    """XOR of a text with the SHAKE-256 keystream of a key; applied twice it gives the text back."""
    stream = hashlib.shake_256(key).digest(len(text))
    both = int.from_bytes(text, "big") ^ int.from_bytes(stream, "big")
    return both.to_bytes(len(text), "big")


def _commitment(plain: bytes, key: bytes) -> str:
    return hashlib.sha256(key + plain).hexdigest()


PLAN, SEALED, REPLIES = "trial.json", "answers.sealed", "replies.jsonl"
OPENED, RECORDS, CAMPAIGNS = "opened.json", "records.json", "campaigns"
SCHEMA = "thermal-robot/trial/1"

Plain = dict[str, Any]
Make = Callable[[Case, Path], Plain]
_FRESH = ("fresh_position", "fresh_before")  # of the answers: what they give is in the record as two numbers


def run_trial(
    cases: Sequence[Case | RealCase],
    directory: str | Path,
    make: Make | None = None,
    *,
    workers: int = 1,
    progress: Callable[[str, int, int], None] = lambda *_: None,
    sealed: Callable[[str], None] = lambda _: None,
    timeout: float = 600.0,
) -> list[Plain]:
    """Run a trial: make campaigns, seal the answers, diagnose, open and judge; or resume one that was stopped.

    Campaigns are made in processes that are started anew, so a script must call this under
    ``if __name__ == "__main__"``. A trial that is taken up again makes them all once more, which gives the same files,
    and has only those diagnosed that have no reply yet.

    Parameters
    ----------
    cases, directory
        What is asked; what keeps campaigns, sealed answers, replies, opened answers and records, made if need be.
    make
        Writes the campaign of a :class:`Case` into a folder and returns the answers; must be picklable. That of
        :mod:`thermal_robot.blind.reality` by default.
    workers, timeout
        How many processes make campaigns, and then diagnose them; s for one diagnosis.
    progress, sealed
        Called with ``"campaigns"`` or ``"diagnoses"``, how many are done, and how many there are; called with the
        commitment of :func:`seal` before the first diagnosis.

    Returns
    -------
    list of dict
        The records, see :mod:`thermal_robot.blind.cases`, in the order of the cases. One whose fault no draw shows has
        ``withdrawn`` and the reason instead of truth and reply.

    Raises
    ------
    ThermalRobotError
        If the directory holds something else, or a campaign cannot be made.
    SealError
        If the sealed answers were altered.
    """
    folder = Path(directory).resolve()
    _take(folder, _identity(cases))
    answers, made = _make_all(cases, folder, make, workers, progress)
    key = secrets.token_bytes(32)
    commitment = seal(answers, folder / SEALED, key)
    del answers  # from here on they are in the file only
    sealed(commitment)
    replies = _read_replies(folder / REPLIES, made)
    asked = [case for case in cases if made[case.id]]
    requests = {case.id: _request(case, folder) for case in asked if case.id not in replies}
    progress("diagnoses", len(replies), len(asked))
    with (
        (folder / REPLIES).open("a", encoding="utf-8") as file,
        closing(examine(requests, folder, workers=workers, timeout=timeout)) as answered,
    ):
        for name, reply in answered:
            replies[name] = reply
            print(json.dumps({"id": name, "campaign": made[name], **reply}), file=file, flush=True)
            progress("diagnoses", len(replies), len(asked))
    opened = open_seal(folder / SEALED, key, commitment)
    # with the key, whoever noted the commitment can now check it
    _write(folder / OPENED, {"commitment": commitment, "key": key.hex(), "answers": opened})
    records = [join(case, opened[case.id], replies.get(case.id)) for case in cases]
    found = {record["id"]: record for record in records}
    for k, case in enumerate(cases):
        if not isinstance(case, Case):
            records[k] = case.judge(records[k], found.get(case.control or ""))
    _write(folder / RECORDS, records)
    return records


def join(case: Case | RealCase, answers: Mapping[str, Any], reply: Mapping[str, Any] | None) -> Plain:
    """Merge a case, its true answers and its reply into one record; without a reply, the reason of its withdrawal."""
    asked: Plain = {"id": case.id, "kind": case.kind}
    if isinstance(case, Case):
        asked |= {"robot": case.robot.name, "without": list(case.without), "hidden": list(case.hidden)}
    if reply is None:
        return {**asked, "withdrawn": answers["withdrawn"]}
    fresh: Plain | None = None
    predicted = reply["predicted"]
    if predicted is not None and answers.get("fresh_position"):
        true = answers["fresh_position"]
        fresh = {"rms_before": _rms(answers["fresh_before"], true), "rms_after": _rms(predicted, true)}
        fresh["shares"] = shares(reply["refitted"], true, answers["noise"] or 0.0)
    true_ones = {name: value for name, value in answers.items() if name not in _FRESH}
    said = {"said": reply["said"], "fresh": fresh, "seconds": reply["seconds"], "error": reply["error"]}
    return {**asked, **true_ones, **said}


def _rms(positions: Sequence[Sequence[float]], true: Sequence[Sequence[float]]) -> float:
    return math.sqrt(sum(math.dist(p, t) ** 2 for p, t in zip(positions, true, strict=True)) / len(true))


def _request(case: Case | RealCase, folder: Path) -> Plain:
    without = list(case.without) if isinstance(case, Case) else []
    request = {"folder": str(folder / CAMPAIGNS / case.id), "without": without, "only": []}
    return {**request, "asks": ASKS[case.kind]} if case.kind in ASKS else request


def _identity(cases: Sequence[Case | RealCase]) -> Plain:
    """Identity of a trial: program version and digest, hash of the cases, number of cases by kind, robots' names."""
    from thermal_robot import __version__

    if len({case.id for case in cases}) < len(cases) or not cases:
        raise ThermalRobotError("a trial needs cases, and each needs an id of its own")
    drawn = json.dumps([asdict(case) for case in cases], sort_keys=True, default=str)
    return {
        "schema": SCHEMA,
        "version": __version__,
        # a program that was changed meanwhile would be judged by some of its predecessor's replies
        "program": _digest(Path(__file__).parents[1], "*.py"),
        "plan": hashlib.sha256(drawn.encode()).hexdigest(),
        "kinds": dict(Counter(case.kind for case in cases)),
        "robots": sorted({case.robot.name for case in cases if isinstance(case, Case)}),
    }


def _take(folder: Path, identity: Plain) -> None:
    """Claim a directory that is empty or holds the trial of this identity; raises ThermalRobotError for any other."""
    file = folder / PLAN
    if file.is_file():
        try:
            found = dict(json.loads(file.read_text(encoding="utf-8")))
        except ValueError:
            found = {}
        different = [name for name, value in identity.items() if found.get(name) != value]
        if different:
            what = "version of the program" if {"version", "program"} & set(different) else "plan"
            raise ThermalRobotError(f"{folder} holds a trial with another {what}; choose or empty the directory")
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise ThermalRobotError(f"{folder} is not empty and holds no trial; choose another directory")
        _write(file, identity)
    except OSError as error:
        raise ThermalRobotError(f"{folder} cannot be written: {error.strerror}") from None


def _make_all(
    cases: Sequence[Case | RealCase],
    folder: Path,
    make: Make | None,
    workers: int,
    progress: Callable[[str, int, int], None],
) -> tuple[dict[str, Plain], dict[str, str]]:
    """Generate all campaigns in worker processes; return answers and SHA-256 of the files by case, "" if withdrawn."""
    answers, made = {}, {}
    pool = ProcessPoolExecutor(min(workers, len(cases)), get_context("spawn"), _quiet)
    try:
        tasks = {pool.submit(_make_one, case, folder / CAMPAIGNS / case.id, make): case.id for case in cases}
        for done, task in enumerate(as_completed(tasks), 1):
            answers[tasks[task]], made[tasks[task]] = task.result()
            progress("campaigns", done, len(cases))
    finally:
        pool.shutdown(cancel_futures=True)
    return answers, made


def _quiet() -> None:
    """Ignore Ctrl-C in a worker, and use one core."""
    from threadpoolctl import threadpool_limits

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(1)


def _make_one(case: Case | RealCase, folder: Path, make: Make | None) -> tuple[Plain, str]:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        if not isinstance(case, Case):
            answers = case.make(folder)
        elif make is not None:
            answers = make(case, folder)
        else:
            from thermal_robot.blind import reality

            answers = reality.make(case, folder)
    except ThermalRobotError as error:  # its own class may not survive the way to the parent
        raise ThermalRobotError(f"the campaign of case {case.id} cannot be made: {error}") from None
    except Exception as error:  # a mistake of the maker's: its traceback is kept
        raise RuntimeError(f"the campaign of case {case.id} cannot be made") from error
    return answers, "" if "withdrawn" in answers else _digest(folder)


def _read_replies(path: Path, made: Mapping[str, str]) -> dict[str, Plain]:
    """Read the replies of an earlier run whose campaign has the same digest as the present one.

    Digests differ in campaigns that were made on another machine, by the last digits of their numbers.
    """
    if not path.is_file():
        return {}
    whole = path.read_bytes()
    complete = whole[: whole.rfind(b"\n") + 1]
    if complete != whole:  # a line that was torn when the trial was stopped
        write_bytes(path, complete)
    try:
        lines = [json.loads(line) for line in complete.splitlines()]
        return {
            line["id"]: {name: line[name] for name in ("said", "predicted", "refitted", "seconds", "error")}
            for line in lines
            if made.get(line["id"]) == line["campaign"]
        }
    except (ValueError, KeyError, TypeError):
        raise ThermalRobotError(f"{path} is damaged; delete it, and the campaigns are diagnosed again") from None


def _digest(folder: Path, pattern: str = "*") -> str:
    total = hashlib.sha256()
    for file in sorted(folder.rglob(pattern)):
        if file.is_file():
            # the length keeps what follows from passing for a part of this file
            content = file.read_bytes()
            total.update(f"{file.relative_to(folder).as_posix()}\n{len(content)}\n".encode() + content)
    return total.hexdigest()


def _write(path: Path, value: Any) -> None:
    write_text(path, json.dumps(value, indent=1, ensure_ascii=False) + "\n")
