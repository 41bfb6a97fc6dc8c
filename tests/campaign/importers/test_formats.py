"""Files of every format become the campaign that they tell of, or are refused by file, row and column."""

import re
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from campaign.importers.written import COMMANDS, complaint, imported, put, rotations

PAGE = (Path(__file__).parents[3] / "docs" / "importers.md").read_text(encoding="utf-8")
EXAMPLE = {kind: re.search(rf"^```{kind}\n(.*?)^```", PAGE, flags=re.M | re.S)[1] for kind in ("csv", "toml")}
RAD_M = '[measurements]\nangle_unit = "rad"\nlength_unit = "m"\n'
RAD_MM = '[measurements]\nangle_unit = "rad"\nlength_unit = "mm"\n'
ROBOT = '[robot]\nurdf = "robot.urdf"\ntool_frame = "tool"\n'
PLACES = {"P1": "1000.25 0.0 500.5", "P2": "900.0 100.0 510.0", "P3": "800.0 200.0 520.0"}
NAMED = dict(zip(PLACES, COMMANDS.split()[1:], strict=True))
"""Commands of each point."""


def commanded(names=("P1", "P2", "P3"), rows=("P1", "P2", "P3")):
    lines = [f"{name},{NAMED[row]}" for name, row in zip(names, rows, strict=True)]
    return "\n".join([f"point,{COMMANDS.split()[0]}", *lines]) + "\n"


def pointed(*names, before="", places=PLACES):
    return "".join(f"{before}{name} {place}\n" for name, place in zip(names or places, places.values(), strict=True))


# a table by a mapping
MAPPING = """
[robot]
urdf = "robot.urdf"
tool_frame = "tool"
[measurements]
angle_unit = "deg"
length_unit = "mm"
[frames]
target = [0.0, 0.0, 80.0]
[noise]
position = 0.02
[table]
separator = "semicolon"
skip = 2
comment = "#"
[columns]
joints = ["J1", "J2", {column = "J3", scale = 1000.0}, {column = "J4", scale = -1.0, offset = 90.0}]
x = "X"
y = 6
z = {sum = ["Z", "dZ"]}
time = {column = "at", time = "%d.%m.%Y %H:%M:%S"}
payload = {value = 5.0}
session = "run"
humidity = "RH"
"""
TABLE = """Log of cell 7
made by hand
J1;J2;J3;J4;X;Y;Z;dZ;at;run;RH;who
# a comment; of any length
10;20;0,03;40;1000,5;0;500;0,25;14.07.2020 16:39:04;a;40;me
-10;15;0,06;400;900;100;510;0;14.07.2020 16:40:04;a;41;me
5;5;0,06;40;;;;;14.07.2020 16:41:04;a;41;me
50;-45;0,09;-40;800;200;520;-1;15.07.2020 16:39:04;b;42;me
"""
LIST = '[table]\nheader = false\nseparator = "space"\n[columns]\njoints = [1, 2, 3, 4]\nx = 5\ny = 6\nz = 7\n'
LISTED = "0.1  0.2 0.03   0.4 1 2\t3\n-0.1 0.3 0.06 3.5 4 5 6\n0.5 -0.4 0.09 -0.4 7 8 9\n"
MEASURED = "point,x,y,z\nP3,7,8,9\nP1,1,2,3\nP9,0,0,0\nP2,4,5,6\nP1,1,2,3.5\n"
BARE = "[table]\nheader = false\n[columns]\njoints = [4, 5, 6, 7]\nx = 1\ny = 2\nz = 3\n"
BARE_JOINTS = "\n".join(COMMANDS.split()[1:]).replace(",", " ")
UNITS = "J1 [deg];J2 [deg];J3 [mm];J4 (rad);X [m];Y (mm);z [um]\n10;20;30;0,4;1,5;20;500\n11;21;60;0,5;1,6;21;510\n"
UNITS += "12;-22;90;0,6;1,7;22;520\n"
# points of a tracker, several targets of a group
GROUPS = '[table]\nkey = "group"\ntargets = "target"\n'
SHIFTS = {"T1": (0.0, 0.0), "T2": (80.0, 0.0), "T3": (0.0, 60.0), "T4": (70.0, 50.0)}  # along x and y, mm


def grouped(*visits, without=()):
    """Lines of a list: group, target, x, y and z, each target shifted by its own."""
    told = []
    for visit in visits:
        x, y, z = map(float, PLACES[visit].split())
        told += [f"{visit} {t} {x + a} {y + b} {z}" for t, (a, b) in SHIFTS.items() if (visit, t) not in without]
    return "\n".join(told) + "\n"


# robot_calibration, FIGAROH, published data sets
STATE = """joint_states:
  header: {{seq: {k}, stamp: {{secs: 1, nsecs: 0}}, frame_id: ''}}
  name: [roll, turn, lift, slide, head_pan]
  position: [{k}, {turn}, 0.2, {slide}, 0.0]
  velocity: []
observations:
  - sensor_name: camera
    features: {features}
---
"""
POINT = "[{{header: {{frame_id: cam}}, point: {{x: {x}, y: 0.5, z: 1.5}}}}, {{point: {{x: 9.0, y: 9.0, z: 9.0}}}}]"
POSES = """
- joints: [turn, lift, slide, roll]
  positions: [0.1, 0.2, 0.03, 0.4]
  features: [f]
- joints: [roll, slide, lift, turn]
  positions: [3.5, 0.06, 0.3, -0.1]
- {joints: [turn, lift, slide, roll], positions: [0.5, -0.4, 0.09, -0.4]}
"""


def samples(count=4, unseen=()):
    each = [(k, "[]" if k in unseen else POINT.format(x=0.1 * k)) for k in range(count)]
    return "".join(STATE.format(k=k, turn=0.1 * k, slide=0.01 * k, features=features) for k, features in each)


IN_ONE = "".join("- " + part.strip().replace("\n", "\n  ") + "\n" for part in samples().split("---\n") if part.strip())
TWO_SENSORS = samples().replace("  - sensor_name", "  - {sensor_name: arm, features: []}\n  - sensor_name")
DATA = """x1,y1,z1,phix1,phiy1,phiz1,x2,y2,z2,turn,lift,slide,roll,shipped_row
1.0,0.1,0.5,0.1,0.2,0.3,2,2,2,0.1,0.2,0.03,0.4,0
0.9,0.2,0.6,0,0,1.5707963267948966,2,2,2,-0.1,0.3,0.06,3.5,1
0.8,0.3,0.7,0.5,0,0,2,2,2,0.5,-0.4,0.09,-0.4,2
"""
POSE = "tool_pose: [0.1, 0.2, 0.3, 0.0, 0.0, 0.0]"
CHAIN = '{base_frame: "universe", tool_frame: "tool"}'
UNIFIED = f"tasks:\n  calibration:\n    kinematics: {CHAIN}\n    measurements:\n      poses:\n        {POSE}\n"
LEGACY = "calibration:\n  base_frame: universe\n  tool_frame: tool\n  tip_pose: [0.1, 0.2, 0.3, 0.0, -1.57, -1.57]\n"
TURNED = '[orientation]\n{}\ncolumns = ["phix1", "phiy1", "phiz1"]\n'
GRID = """step_order,x_t,y_t,z_t,x_dif,y_dif,z_dif,joint_1,joint_2,joint_3,joint_4
0,100.0,200.0,300.0,0.5,-0.5,0.25,10,20,30,40
1,110.0,200.0,300.0,0.5,-0.5,0.25,11,22,33,44
2,120.0,210.0,300.0,0.5,-0.5,0.25,12,24,36,48
"""
SERIES = "Timestamp;turn;lift;slide;roll;measurement_temperature;measurement_x;measurement_y;measurement_z;"
SERIES += """measurement_rx;measurement_ry;measurement_rz
{};0,1;0,2;0,03;0,4;23,5;1000,5;0;500;90,0;0;90,0
{};-0,1;0,3;0,06;3,5;23,6;900;100;510;0;0;0
{};0,5;-0,4;0,09;-0,4;23,7;800;200;520;0;30,0;0
"""
STAMPED = SERIES.format("20200714163904", "20200714163924", "20200715163904")
H = np.sqrt(0.75)
LOST = SERIES.format(*["2,02011E+13"] * 3)
JOINTS = np.array([[0.1, 0.2, 0.03, 0.4], [-0.1, 0.3, 0.06, 3.5], [0.5, -0.4, 0.09, -0.4]])
IN_MM = JOINTS * [1.0, 1.0, 1e-3, 1.0]  # the third one slides
LINE = ["{n} {p}", "B {n} {p}", "A B {n} {p}", "A, B, {n}, {c}", "{n},{c}", "A\tB\t{n}\t{t}", "A B {n} {p} 0.01"]
ORDER = ["P3", "P1", "P2", "P1"]
CENTRES = np.array([list(map(float, PLACES[name].split())) for name in ORDER])
POINTS = 1e-3 * (CENTRES[:, None] + [(*along, 0.0) for along in SHIFTS.values()])
POINTS[2, 1] = np.nan


def laid_out(line):
    told = {n: {"p": p, "c": p.replace(" ", ", "), "t": p.replace(" ", "\t")} for n, p in PLACES.items()}
    return "\n".join(["// SA 2024.1, frame A::WORLD", "// X Y Z", *(line.format(n=n, **told[n]) for n in ORDER)])


# format, files, mapping, what the campaign has: q, position, and covariates by name; labels; what is said
SOUND = {
    "a mapping": (
        "table", {"log.csv": TABLE}, MAPPING,
        {"q": np.c_[np.deg2rad([[10, 20], [-10, 15], [50, -45]]), [0.03, 0.06, 0.09], np.deg2rad([50, -310, 130])],
         "position": [[1.0005, 0, 0.50025], [0.9, 0.1, 0.51], [0.8, 0.2, 0.519]], "time": [0, 60, 86400],
         "payload": [5.0] * 3, "humidity": [40, 41, 42], "session": ["a", "a", "b"], "target": [0, 0, 0.08],
         "noise_position": 2e-5},
        "4 rows read, 3 taken; 1 row (7) left out, without a measured position; columns left out: 'who'",
    ),
    "numbers": (
        "table", {"log.txt": LISTED}, LIST + RAD_M, {"q": JOINTS, "position": [[1, 2, 3], [4, 5, 6], [7, 8, 9]]}, ""
    ),
    "two tables": (
        "table", {"p.csv": MEASURED, "c.csv": commanded()}, '[table]\nkey = "point"\n' + RAD_M,
        {"q": JOINTS[[2, 0, 1, 0]], "position": [[7, 8, 9], [1, 2, 3], [4, 5, 6], [1, 2, 3.5]]},
        "1 points left out, not commanded: 'P9'",
    ),
    "two lists": (
        "table", {"p.txt": "1 2 3\n4 5 6\n7 8 9.5\n", "j.txt": BARE_JOINTS}, BARE + RAD_M,
        {"q": JOINTS, "position": [[1, 2, 3], [4, 5, 6], [7, 8, 9.5]]}, "3 rows read, 3 taken",
    ),
    "units": (
        "table", {"log.csv": UNITS}, '[columns]\nj = "J1"\nx = "X"\n',
        {"q": np.c_[np.deg2rad([[10, 20], [11, 21], [12, -22]]), [0.03, 0.06, 0.09], [0.4, 0.5, 0.6]],
         "position": [[1.5, 0.02, 5e-4], [1.6, 0.021, 5.1e-4], [1.7, 0.022, 5.2e-4]]}, "",
    ),
    **{
        f"points, {line}": (
            "points", {"points.txt": laid_out(line), "commands.csv": commanded()}, RAD_MM,
            {"q": IN_MM[[2, 0, 1, 0]], "pose": ORDER,
             "position": [[0.8, 0.2, 0.52], [1.00025, 0, 0.5005], [0.9, 0.1, 0.51], [1.00025, 0, 0.5005]]}, "",
        ) for line in LINE
    },
    **{
        f"points, decimal commas, {mark!r}": (
            "points", {"p.txt": pointed().replace(".", ",").replace(" ", mark), "c.csv": commanded()}, RAD_MM,
            {"q": IN_MM, "position": [[1.00025, 0, 0.5005], [0.9, 0.1, 0.51], [0.8, 0.2, 0.52]]}, "",
        ) for mark in ";\t "
    },
    "points, numbers": (
        "points", {"p.txt": pointed(*"123", before="Main "), "c.csv": commanded("123")}, RAD_MM,
        {"q": IN_MM, "pose": ["1", "2", "3"]}, "",
    ),
    "points, a header": (
        "points", {"p.csv": "Name;X;Y;Z;RMS\nP2;900,5;100;510;0,01\nP1;1000;0;500;0,01\nP3;800;200;520;0,02\n",
                   "c.csv": commanded()}, RAD_MM,
        {"position": [[0.9005, 0.1, 0.51], [1.0, 0, 0.5], [0.8, 0.2, 0.52]]}, "columns left out: 'RMS'",
    ),
    "points, no names": (
        "points", {"p.txt": "\n".join(PLACES.values()), "c.csv": COMMANDS}, RAD_MM,
        {"q": IN_MM, "position": [[1.00025, 0, 0.5005], [0.9, 0.1, 0.51], [0.8, 0.2, 0.52]]}, "joined in their order",
    ),
    "points, some": (
        "points", {"p.txt": "P1 1 2 3\nP2 1 2 4\nP9 1 2 5\nP4 1 2 6\n", "c.csv": commanded() + "P4,0.7,0.1,0.01,0.2\n"},
        RAD_MM, {"pose": ["P1", "P2", "P4"]},
        "1 points left out, not commanded: 'P9'; 1 commands left out, not measured: 'P3'",
    ),
    "points, groups": (
        "points", {"p.txt": grouped(*ORDER, without={("P2", "T2")}), "c.csv": commanded()}, GROUPS + RAD_MM,
        {"q": IN_MM[[2, 0, 1, 0]], "pose": ORDER, "targets.points": POINTS},
        "4 targets of each pose, numbered so: 'T1', 'T2', 'T3', 'T4'",
    ),
    "samples": (
        "robot_calibration", {"s.yaml": samples(5, unseen=[2])}, "",
        {"q": [[0.1 * k, 0.2, 0.01 * k, k] for k in (0, 1, 3, 4)],
         "position": [[x, 0.5, 1.5] for x in (0.0, 0.1, 0.3, 0.4)]},
        "feature 1 of sensor 'camera' taken as the target; 5 rows read, 4 taken; 1 row (3) left out",
    ),
    "samples in one list": (
        "robot_calibration", {"s.yaml": IN_ONE}, "",
        {"q": [[0.1 * k, 0.2, 0.01 * k, k] for k in range(4)], "position": [[0.1 * k, 0.5, 1.5] for k in range(4)]}, "",
    ),
    "another sensor and feature": (
        "robot_calibration", {"s.yaml": TWO_SENSORS}, '[recording]\nsensor = "camera"\nfeature = 2\n',
        {"position": [[9.0] * 3] * 4}, "",
    ),
    "capture poses": (
        "robot_calibration", {"p.yaml": POSES, "m.csv": "x,y,z\n1,2,3\n4,5,6\n7,8,9\n"}, "",
        {"q": JOINTS, "position": [[1, 2, 3], [4, 5, 6], [7, 8, 9]]}, "",
    ),
    **{
        f"figaroh, {text[:5]}": (
            "figaroh", {"d.csv": DATA, "c.yaml": text}, '[robot]\nurdf = "robot.urdf"\n',
            {"q": JOINTS, "position": [[1.0, 0.1, 0.5], [0.9, 0.2, 0.6], [0.8, 0.3, 0.7]], "target": [0.1, 0.2, 0.3],
             "measures": "position"}, "marker 1 of 2 taken; … phix1 phiy1 phiz1 left out",
        ) for text in (UNIFIED, LEGACY)
    },
    "another marker": (
        "figaroh", {"d.csv": DATA}, '[columns]\nx = "x2"\ny = "y2"\nz = "z2"\n', {"position": [[2.0] * 3] * 3}, ""
    ),
    "jacobi": (
        "jacobi", {"grid.csv": GRID}, "",
        {"position": [[0.1005, 0.1995, 0.30025], [0.1105, 0.1995, 0.30025], [0.1205, 0.2095, 0.30025]],
         "order": [0, 1, 2]}, "",
    ),
    "stamps": (
        "ipa_ur10", {"s.csv": STAMPED}, "",
        {"q": IN_MM, "time": [0, 20, 86400], "temperature": [23.5, 23.6, 23.7],
         "position": [[1.0005, 0, 0.5], [0.9, 0.1, 0.51], [0.8, 0.2, 0.52]],
         "rotation": [[[0, -1, 0], [0, 0, -1], [1, 0, 0]], np.eye(3), [[H, 0, 0.5], [0, 1, 0], [-0.5, 0, H]]]}, "",
    ),
    "lost stamps": (
        "ipa_ur10", {"s.csv": LOST}, "", {"q": IN_MM, "order": [0, 1, 2]}, "the time stamps are no instants"
    ),
}  # fmt: skip


def mapped(folder, files, mapping):
    """Put down files and the mapping; give the arguments, and whether the mapping lacks a robot."""
    put(folder, m__toml=mapping, **{name.replace(".", "__"): text for name, text in files.items()})
    return [*files, *(["--mapping", "m.toml"] if mapping else [])], "[robot]" not in mapping


@pytest.mark.parametrize("case", SOUND)
def test_files_become_the_campaign_that_they_tell_of(tmp_path, capsys, case):
    format, files, mapping, expected, said = SOUND[case]
    arguments, robot = mapped(tmp_path, files, mapping)
    campaign, out = imported(capsys, tmp_path, format, *arguments, robot=robot)
    for name, values in expected.items():
        if name in campaign.labels:
            assert campaign.labels[name].tolist() == values
        elif name == "measures":
            assert campaign.measures == values
        elif name == "rotation":
            np.testing.assert_allclose(rotations(campaign), values, atol=1e-12)
        else:
            found = campaign.covariates[name] if name in campaign.covariates else attrgetter(name)(campaign)
            np.testing.assert_allclose(found, values, atol=1e-12, err_msg=name)
    assert all(part.strip() in out for part in said.split("…"))
    assert (
        (tmp_path / "made" / "campaign.toml").read_text().startswith(f"# Imported by `thermal-robot import {format}`")
    )


@pytest.mark.parametrize(
    "kind", ['kind = "rotation_vector"\nunit = "rad"', 'kind = "euler"\nsequence = "xyz"\nunit = "rad"']
)
def test_an_orientation_is_taken_once_the_mapping_says_what_it_is(tmp_path, capsys, kind):
    campaign, _ = imported(capsys, tmp_path, "figaroh", *mapped(tmp_path, {"d.csv": DATA}, TURNED.format(kind))[0])
    turned = rotations(campaign)
    np.testing.assert_allclose(turned[1], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    is_vector = np.isclose(np.arccos((np.trace(turned[0]) - 1) / 2), np.linalg.norm([0.1, 0.2, 0.3]), atol=1e-9)
    assert is_vector == ("vector" in kind)


def test_the_example_of_the_page_is_imported(tmp_path, capsys):
    arguments, _ = mapped(tmp_path, {"log.csv": EXAMPLE["csv"]}, EXAMPLE["toml"])
    campaign, out = imported(capsys, tmp_path, "table", *arguments, robot=False)
    assert "5 rows read, 4 taken; 1 row (5) left out" in out
    np.testing.assert_allclose(np.rad2deg(campaign.q[0]), [-7.45, 60.52, -82.20, 63.23, -87.60])
    np.testing.assert_allclose(1e3 * campaign.position[1], [-1151.046, -458.460, -1125.218])
    np.testing.assert_allclose(campaign.covariates["time"], [0, 47, 147, 196])
    np.testing.assert_allclose(campaign.covariates["payload"], [0, 0, 3, 3])
    assert campaign.measures == "pose"


CALIBRATION, ONE_ROW = "robot_calibration", {"two.txt": "1.0 2.0 3.0\n", "c.csv": commanded()}
# format, files, mapping, what is said
REFUSED = [
    *(("table", {"log.csv": TABLE}, MAPPING.replace(was, becomes), said) for was, becomes, said in (
        ('x = "X"', 'x = "XX"', "log.csv, row 3, column 'XX': there is no such column; did you mean 'X'?"),
        ('x = "X"', "x = 40", "log.csv, row 3, column '40': there is no such column"),
        ('"J1", ', "", "m.toml, column 'columns.joints': another number of joints than the chain has; found 3"),
        ("%d.%m.%Y", "%d/%m/%Y", "row 5, column 'at': no instant of this pattern; found '14.07.2020 16:39:04'"),
        ("{value = 5.0}", "{value = 5.0, count = true}", "row 22, column 'columns.payload': wrong kind"),
        ("[columns]", "[colums]", "m.toml, row 16, column 'colums': unknown section or key; did you mean"),
        ("skip = 2", "skip = -1", "m.toml, row 14, column 'table.skip': wrong kind of value; found -1"),
        ('"semicolon"', '";"', "found ';', expected \"comma\" or \"semicolon\" or \"tab\" or \"space\""),
        ('length_unit = "mm"', "", "m.toml: no length_unit is stated, expected [measurements] length_unit"),
        ('urdf = "robot.urdf"', "", "m.toml: no robot is named, expected --robot URDF"),
    )),
    *(("table", {"log.csv": TABLE.replace(was, becomes)}, MAPPING, said) for was, becomes, said in (
        ("1000,5;0;", "1000,5;;", "log.csv, row 5, column '6': a value is missing, for the column 'y' of the campaign"),
        (";40;1000", ";forty;1000", "log.csv, row 5, column 'J4': text where a number should be; found 'forty'"),
        (";who", ";", "log.csv, row 3: a column has no name"),
    )),
    ("table", {"log.csv": TABLE}, MAPPING.replace("{value = 5.0}", '{value = "a"}'),
     "log.csv: text where a number should be; found 'a'"),
    ("table", {"p.txt": "1 2 3\n4 5 6\n7 8 9.5\n", "j.txt": BARE_JOINTS}, BARE.split("\n", 2)[2] + RAD_M,
     "the first line of p.txt is numbers alone and was taken for a header … `header = false` … "
     "found 2 and 3 rows, without that line"),
    ("points", {"p.txt": pointed("QP1", "QP2", "QP3"), "c.csv": commanded()}, RAD_MM,
     "p.txt, column 'target': no point has a name that stands in c.csv; found 'QP1', 'QP2', 'QP3'"),
    ("points", {"p.txt": pointed(), "twice.csv": commanded(("P1", "P1", "P2"))}, RAD_MM,
     "twice.csv, row 3, column 'point': a point is commanded more than once; found 'P1', as in row 2"),
    ("points", {"p.txt": pointed(), "c.csv": commanded()}, '[table]\nkey = "name"\n' + RAD_MM,
     "p.txt, column 'name': there is no such column; found 4 columns without names"),
    ("points", ONE_ROW, RAD_MM, "found 1 and 3 rows"),
    ("points", {"p.txt": pointed(), "c.csv": commanded().replace("turn", "armL1")}, RAD_MM,
     "column 'turn': there is no such column; … 'armL1'"),
    ("points", {"p.txt": "P1 1 2 3\nP2 1 2\n", "c.csv": commanded()}, RAD_MM, "p.txt: is no list of points"),
    ("points", {"p.txt": pointed()}, RAD_MM, "found 1, expected POINTS COMMANDS.csv"),
    ("points", {"p.txt": pointed(), "c.csv": commanded()}, "", "no angle_unit is stated"),
    ("points", {"p.txt": pointed("P1 T1", "P2 T1", "P3 T1"), "c.csv": commanded()}, GROUPS + RAD_MM,
     "a single target of each pose; found 'T1'"),
    ("points", {"p.txt": pointed(), "c.csv": commanded()}, GROUPS + RAD_MM, "column 'group': there is no such column"),
    ("table", {"p.csv": "X,Y,Z\n1,2,3\n", "c.csv": commanded()}, GROUPS + RAD_MM,
     "column 'table.targets': is for lists of points"),
    (CALIBRATION, {"s.yaml": TWO_SENSORS}, "",
     "it is not clear which sensor measured; found 'arm', 'camera', expected [recording] sensor"),
    (CALIBRATION, {"p.yaml": POSES}, "", "p.yaml: holds poses and no measurements"),
    (CALIBRATION, {"s.yaml": STATE.format(k=0, turn=0, slide=0, features=5)}, "",
     "s.yaml, [0]: is no sample; … a list of features"),
    (CALIBRATION, {"s.yaml": "joint_states: 1\nobservations: 5\n"}, "", "there are no observations"),
    (CALIBRATION, {"s.yaml": "- 3\n"}, "", "s.yaml, [0]: is no sample; found 3"),
    (CALIBRATION, {"s.yaml": samples(3).replace("point:", "place:")}, "", "s.yaml, [0]: is no sample"),
    (CALIBRATION, {"s.yaml": samples(3).replace("slide", "slid")}, "", "column 'slide': there is no such column"),
    ("figaroh", {"d.csv": DATA, "c.yaml": "robot: ur10\n"}, "",
     "c.yaml, calibration: is no configuration of FIGAROH, expected tasks.calibration"),
    ("figaroh", {"d.csv": DATA, "c.yaml": UNIFIED.replace("0.1", ".nan")}, "",
     "c.yaml, column 'frames.target': wrong kind of value; found [nan, 0.2, 0.3], expected three numbers"),
    ("kuka", {"a.dat": "DECL E6AXIS XP1={A1 1,A2 2,A3 3,A4 4}\n", "m.csv": "point,x,y,z\nP1,1,2,3\n"},
     '[table]\nkey = "name"\n', "m.csv, row 1, column 'name': there is no such column"),
    ("corners", {"c.csv": "u,v,camera\n1,2,a\n", "j.csv": commanded()}, "",
     "c.csv, row 1, column 'image': there is no such column"),
    ("figaroh", {"d.csv": DATA, "c.yaml": "a: [1,\nb: 2\n"}, "", "c.yaml, row 3: not valid YAML"),
]  # fmt: skip


@pytest.mark.parametrize(("format", "files", "mapping", "said"), REFUSED, ids=lambda value: str(value)[:20])
def test_what_cannot_be_used_is_told_by_file_row_and_column(tmp_path, capsys, format, files, mapping, said):
    arguments, robot = mapped(tmp_path, files, mapping)
    told = complaint(capsys, tmp_path, format, *arguments, robot=robot)
    assert all(part.strip() in told for part in said.split("…")), told
