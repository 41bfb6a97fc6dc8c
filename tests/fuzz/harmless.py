"""Changes of a campaign's files that change nothing of what they say."""

from __future__ import annotations

import csv
import io
import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from random import Random

import tomli_w
from fuzz.corpus import Files, as_frame, as_parquet

from thermal_robot.campaign.document import tomllib

LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "inch": 0.0254, "ft": 0.3048, "cm": 0.01}
OF_LENGTH = ("x", "y", "z", "sim.x", "sim.y", "sim.z", "noise", *(f"{axis}.{k}" for axis in "xyz" for k in range(1, 5)))
OF_ANGLE = ("approach", "torque", "temperature")  # prefixes of joints' and links' columns that are no angles
WITH_JOINT = ("velocity", "acceleration", "encoder")

Change = Callable[[Random, Files], Files]


def table(files: Files) -> list[list[str]]:
    return list(csv.reader(io.StringIO(files["measurements.csv"].decode(), newline="")))


def with_table(
    files: Files, rows: list[list[str]], *, end: str = "\n", delimiter: str = ",", quoting: int = csv.QUOTE_MINIMAL
) -> Files:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator=end, delimiter=delimiter, quoting=quoting).writerows(rows)
    return {**files, "measurements.csv": text.getvalue().encode()}


def is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def columns_moved(rng: Random, files: Files) -> Files:
    rows = table(files)
    order = rng.sample(range(len(rows[0])), len(rows[0]))
    return with_table(files, [[row[j] for j in order] for row in rows])


def rows_moved(rng: Random, files: Files) -> Files:
    rows = table(files)
    order = rng.sample(range(len(rows) - 1), len(rows) - 1)
    moved = with_table(files, [rows[0], *(rows[1 + i] for i in order)])
    return {**moved, "rows.json": json.dumps(order).encode()}


def numbers_written_otherwise(rng: Random, files: Files) -> Files:
    head, *body = table(files)
    ways = (lambda c: f"{float(c):.17e}", lambda c: f"{float(c):.17G}", lambda c: f"+{c}".replace("+-", "-"),
    lambda c: f" {c} ",
            lambda c: f"00{c}" if c[0].isdigit() else c)  # fmt: skip
    chosen = [j for j, name in enumerate(head) if name not in ("session", "pose", "path")]
    for row in body:
        for j in chosen:
            row[j] = rng.choice(ways)(row[j]) if is_number(row[j]) else row[j]
    return with_table(files, [head, *body])


def another_dialect(rng: Random, files: Files) -> Files:
    rows = table(files)
    delimiter = rng.choice(",;\t")
    if delimiter != "," and rng.random() < 0.5:
        rows = [rows[0], *([c.replace(".", ",") if is_number(c) else c for c in row] for row in rows[1:])]
    quoting = rng.choice((csv.QUOTE_MINIMAL, csv.QUOTE_ALL))
    changed = with_table(files, rows, end=rng.choice(("\n", "\r\n", "\n\n")), delimiter=delimiter, quoting=quoting)
    text = changed["measurements.csv"].decode()
    return {**changed, "measurements.csv": text.encode(rng.choice(("utf-8", "utf-8-sig", "utf-16")))}


def one_more_column(rng: Random, files: Files) -> Files:
    head, *body = table(files)
    at = rng.randrange(len(head) + 1)
    head.insert(at, "air_pressure")
    for row in body:
        row.insert(at, repr(rng.gauss(1013.0, 5.0)))
    return with_table(files, [head, *body])


def other_units(rng: Random, files: Files) -> Files:
    """The same lengths and angles in other units, in the table and in what is declared."""
    document = tomllib.loads(files["campaign.toml"].decode())
    old = document["measurements"]
    length, angle = rng.choice(sorted(LENGTHS)), rng.choice(("rad", "deg"))
    by_length = LENGTHS[old["length_unit"]] / LENGTHS[length]
    by_angle = {("deg", "rad"): math.pi / 180, ("rad", "deg"): 180 / math.pi}.get((old["angle_unit"], angle), 1.0)
    kinds = {j.get("name"): j.get("type") for j in ET.fromstring(files["robot.urdf"]).iter("joint")}
    head, *body = table(files)
    for j, name in enumerate(head):
        prefix, _, joint = name.partition(".")
        kind = kinds.get(joint if prefix in WITH_JOINT else name)
        factor = by_length if name in OF_LENGTH or kind == "prismatic" else by_angle if kind else 1.0
        for row in body:
            row[j] = repr(float(row[j]) * factor) if factor != 1.0 and row[j] else row[j]
    for section, key in (("frames", "target"), ("payload", "com")):
        if key in document.get(section, {}):
            document[section][key] = [value * by_length for value in document[section][key]]
    if "position" in document.get("noise", {}):
        document["noise"]["position"] *= by_length
    document["measurements"] = {**old, "length_unit": length, "angle_unit": angle}
    return {**with_table(files, [head, *body]), "campaign.toml": tomli_w.dumps(document).encode()}


def as_parquet_file(rng: Random, files: Files) -> Files:
    frame = as_frame(files)
    for name in frame.columns:
        if name in ("session", "pose", "path"):
            frame[name] = frame[name].astype(str)
    document = tomllib.loads(files["campaign.toml"].decode())
    document["measurements"]["file"] = "measurements.parquet"
    toml = tomli_w.dumps(document).encode()
    return {**files, "measurements.parquet": as_parquet(frame), "campaign.toml": toml}


def toml_written_otherwise(rng: Random, files: Files) -> Files:
    document = tomllib.loads(files["campaign.toml"].decode())
    lines = ["# a comment"]
    for section in rng.sample(sorted(document), len(document)):
        lines.append(f"[ {section} ]  # [robot]" if rng.random() < 0.5 else f'["{section}"]')
        for key in rng.sample(sorted(document[section]), len(document[section])):
            value = document[section][key]
            whole = isinstance(value, float) and value.is_integer() and rng.random() < 0.5
            text = str(int(value)) if whole else tomli_w.dumps({"v": value})[4:].strip()
            lines.append(f'  "{key}"   = {text}')
    return {**files, "campaign.toml": rng.choice(("\n", "\r\n")).join(lines).encode()}


def urdf_written_otherwise(rng: Random, files: Files) -> Files:
    """Links and joints in another order, attributes, too; colours and shapes added; comments between."""
    root = ET.fromstring(files["robot.urdf"])
    parts = rng.sample(list(root), len(root))
    root[:] = parts
    for element in root.iter():
        keys = rng.sample(sorted(element.attrib), len(element.attrib))
        element.attrib = {key: element.attrib[key] for key in keys}
        element.tail = rng.choice(("\n", "  ", "\n<!-- -->\n".replace("<!-- -->", "")))
    ET.SubElement(ET.SubElement(root, "material", name="added"), "color", rgba="0.5 0.5 0.5 1")
    return {**files, "robot.urdf": b"<?xml version='1.0'?>\n<!-- a comment -->\n" + ET.tostring(root)}


CHANGES: tuple[Change, ...] = (
    columns_moved, rows_moved, numbers_written_otherwise, another_dialect, one_more_column, other_units,
    as_parquet_file,
    toml_written_otherwise, urdf_written_otherwise,
)  # fmt: skip
LAST = (another_dialect, as_parquet_file)
"""After which the table is no plain CSV file any more."""


def changed(rng: Random, files: Files) -> Files:
    """One to three of the changes."""
    chosen = rng.sample(CHANGES, rng.randrange(1, 4))
    chosen.sort(key=LAST.__contains__)
    for change in [c for c in chosen if c not in LAST] + [c for c in chosen if c in LAST][:1]:
        files = change(rng, files)
    return files
