"""What is fuzzed: how a trial is drawn from its number, and what a sound answer to it is."""

from __future__ import annotations

import csv
import io
import json
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

import tomli_w
from fuzz import checks, corpus, harmless, mutate
from fuzz.corpus import Files
from fuzz.drawn import drawn
from fuzz.mutate import NUMBERS, WORDS, spoilt_frame

from thermal_robot.campaign.document import tomllib


@dataclass(frozen=True)
class Target:
    """One reader.

    ``draw`` spoils sound files, ``check`` reads them as a user would, in the folder that holds them; it raises
    ``ThermalRobotError`` where they are refused, and ``AssertionError`` where the answer is wrong.
    """

    name: str
    draw: Callable[[Random], Files]
    check: Callable[[Path], None]
    seconds: float = 10.0
    """Of CPU that one trial may take."""

    def trial(self, seed: int, number: int) -> Files:
        """The files of one trial, always the same."""
        return self.draw(Random(f"{seed}/{self.name}/{number}"))


def again(rng: Random, change: Callable[[Random, bytes], bytes], data: bytes) -> bytes:
    """Some changes on top of each other; mostly one, so that its cause is plain."""
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        data = change(rng, data)
    return data


def spoilt_rows(rng: Random, data: bytes) -> bytes:
    """A CSV file spoilt as a table."""
    try:
        rows = list(csv.reader(io.StringIO(data.decode(errors="replace"), newline="")))
    except csv.Error:
        rows = []
    if not rows:
        return mutate.spoilt_bytes(rng, data)
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n", escapechar="\\").writerows(mutate.spoilt_table(rng, rows))
    return text.getvalue().encode("utf-8", "surrogatepass")


def spoilt_toml(rng: Random, data: bytes) -> bytes:
    """A TOML file spoilt as a tree."""
    try:
        tree = mutate.spoilt_tree(rng, tomllib.loads(data.decode()))
        return tomli_w.dumps(tree if isinstance(tree, dict) else {"x": tree}).encode("utf-8", "surrogatepass")
    except (TypeError, ValueError):  # what TOML cannot hold
        return mutate.spoilt_number(rng, data)


def spoilt_json(rng: Random, data: bytes) -> bytes:
    """A JSON file spoilt as a tree."""
    try:
        return json.dumps(mutate.spoilt_tree(rng, json.loads(data))).encode()
    except ValueError:
        return mutate.spoilt_bytes(rng, data)


def spoilt_xml(rng: Random, data: bytes) -> bytes:
    """A URDF spoilt as XML, or its bytes once it is none."""
    try:
        return mutate.spoilt_xml(rng, data)
    except (mutate.ET.ParseError, ValueError):
        return mutate.spoilt_bytes(rng, data)


def one_file(name: str, *changes: Callable[[Random, bytes], bytes]) -> Callable[[Random], Files]:
    """Spoil one file of a campaign, by its structure mostly."""

    def draw(rng: Random) -> Files:
        files = rng.choice(corpus.campaigns())
        change = rng.choice((*changes, *changes, mutate.spoilt_bytes))
        return {**files, name: again(rng, change, files[name])}

    return draw


def urdf(rng: Random) -> Files:
    if rng.random() < 0.002:
        return {**corpus.campaigns()[0], "robot.urdf": corpus.BOMB}
    return one_file("robot.urdf", spoilt_xml, mutate.spoilt_number)(rng)


def parquet(rng: Random) -> Files:
    files = rng.choice(corpus.campaigns())
    document = tomllib.loads(files["campaign.toml"].decode())
    document["measurements"]["file"] = "measurements.parquet"
    frame = corpus.as_frame(files)
    data = b""
    for _ in range(5):  # until a frame that Parquet holds
        try:
            data = corpus.as_parquet(spoilt_frame(rng, frame))
            break
        except Exception:  # pyarrow's own, many kinds
            data = corpus.as_parquet(frame)
    if rng.random() < 0.5:
        data = again(rng, mutate.spoilt_bytes, data)
    kept = {"robot.urdf": files["robot.urdf"], "campaign.toml": tomli_w.dumps(document).encode()}
    return {**kept, "measurements.parquet": data}


def frame(rng: Random) -> Files:
    files = rng.choice(corpus.campaigns())
    units = tomllib.loads(files["campaign.toml"].decode())["measurements"]
    given = {key: units[key] for key in ("angle_unit", "length_unit")}
    if rng.random() < 0.5:
        given |= {"target": [0.0, 0.0, 80.0], "noise_position": 0.02, "gears": {}, "priors": {}}
    table = corpus.as_frame(files)
    for _ in range(rng.choice((0, 1, 1, 2))):
        table = spoilt_frame(rng, table)
    spoilt = mutate.spoilt_tree(rng, given) if rng.random() < 0.3 else given
    spoilt = spoilt if isinstance(spoilt, dict) else given
    known = {k: v for k, v in spoilt.items() if k in given}  # an unknown argument is Python's own to refuse
    kept = {name: files[name] for name in ("robot.urdf", "campaign.toml")}
    return {**kept, "table.pickle": pickle.dumps((table, known))}


def model(rng: Random) -> Files:
    files = rng.choice(corpus.models())
    if rng.random() < 0.2:
        return {**files, "samples.csv": again(rng, spoilt_rows, files["samples.csv"])}
    change = rng.choice((spoilt_json, spoilt_json, mutate.spoilt_number, mutate.spoilt_bytes))
    return {**files, "model.json": again(rng, change, files["model.json"])}


COMMANDS = (
    "demo -x", "check campaign.toml", "effects campaign.toml", "diagnose campaign.toml --json out.json",
    "predict model.json samples.csv -o out.csv", "iso9283 campaign.toml", "paper --json out.json", "blind --seed x",
)  # fmt: skip
OPTIONS = (
    "--json", "--csv", "--report", "--model", "--without", "--only", "-o", "--output", "--l5", "--markdown", "--help",
    "-V", "--", "-",
)  # fmt: skip
PLACES = (
    "campaign.toml", ".", "measurements.csv", "robot.urdf", "model.json", "samples.csv", "out.csv", "out.json",
    "out.html", "no/such/out", "campaign.toml/x", "joint_offset", "backlash", "no_effect", "a" * 300, "0.15",
)  # fmt: skip


def arguments(rng: Random) -> Files:
    """Some words of the command line; blind trials, which last, only where they are refused at once."""
    files = {**corpus.campaigns()[0], **corpus.models()[0]}
    words = rng.choice(COMMANDS).split()
    for _ in range(rng.randrange(4)):
        at = rng.randrange(len(words) + 1)
        new = rng.choice((rng.choice(OPTIONS), rng.choice(PLACES), rng.choice(WORDS), str(rng.choice(NUMBERS))[:50]))
        words[at : at + rng.randrange(2)] = [] if rng.random() < 0.2 else [new]
    # no path of this machine is written to, and nothing that lasts is begun
    words = [w for w in words if not w.startswith(("/", "..")) and len(w) < 5000]
    if "blind" in words[:1]:
        words = ["blind", "--seed", "x", *words[1:]]
    if "demo" in words[:1]:
        words = ["demo", *words[1:], "-x"]
    return {**files, "arguments.json": json.dumps(words).encode()}


def same(rng: Random) -> Files:
    which = rng.randrange(len(corpus.campaigns()))
    files = corpus.campaigns()[which]
    return {**harmless.changed(rng, files), "like.json": json.dumps(which).encode()}


def whole(rng: Random) -> Files:
    """A campaign that is to be diagnosed: extreme values in its table, other declarations."""
    files = dict(rng.choice(corpus.campaigns()[:4]))
    head, *body = harmless.table(files)
    for _ in range(rng.choice((0, 1, 1, 2, 3))):
        j, i = rng.randrange(len(head)), rng.randrange(len(body))
        kind = rng.randrange(5)
        for k in range(len(body)):
            if (k == i or kind > 1) and harmless.is_number(body[k][j]):
                body[k][j] = spoilt_value(rng, kind, body, j, k)
    body = body[: rng.choice((1, 2, 3, 5, 8))] if rng.random() < 0.3 else body
    body += body[:1] * rng.choice((0, 0, 0, 3, 30))
    document = tomllib.loads(files["campaign.toml"].decode())
    if rng.random() < 0.4:
        document["frames"].update(base=rng.choice(("known", "unknown")), tool=rng.choice(("known", "unknown")))
    if rng.random() < 0.3:
        noises = {}, {"position": 1e-12}, {"position": 1e12}, {"position": 0.02, "orientation": 1e-15}
        document["noise"] = rng.choice(noises)
    if rng.random() < 0.2:
        robots = {"moves": "unknown"}, {"gravity": [0.0, 0.0, 0.0]}, {"reference_temperature": -400.0}
        document["robot"].update(rng.choice(robots))
    if rng.random() < 0.2:
        document["priors"] = {rng.choice(("joint_offset", "geometric", "backlash")): rng.choice((1e-30, 1e30, 1.0))}
    return {**harmless.with_table(files, [head, *body]), "campaign.toml": tomli_w.dumps(document).encode()}


def spoilt_value(rng: Random, kind: int, body: list[list[str]], j: int, k: int) -> str:
    """An extreme in one cell or in all, one value in all, or the column times a factor."""
    if kind in (0, 1):
        return mutate.written(rng.choice(NUMBERS))
    if kind == 2:
        return body[0][j]
    value = float(body[k][j])
    return repr(value * 1e3) if kind == 3 else repr(round(value))


TARGETS = {
    target.name: target
    for target in (
        Target("urdf", urdf, checks.reading),
        Target("toml", one_file("campaign.toml", spoilt_toml, mutate.spoilt_number), checks.reading),
        Target("csv", one_file("measurements.csv", spoilt_rows, mutate.spoilt_number), checks.reading),
        Target("parquet", parquet, checks.reading),
        Target("frame", frame, checks.frame),
        Target("model", model, checks.model),
        Target("arguments", arguments, checks.arguments),
        Target("same", same, checks.same),
        Target("diagnose", whole, checks.diagnosis, seconds=60.0),
        Target("drawn", drawn, checks.diagnosis, seconds=240.0),
    )
}
"""By name."""

ITSELF = Target("itself", lambda _: {}, checks.itself, seconds=0.5)
"""What the files say is done: so that a worker can be seen to die."""
