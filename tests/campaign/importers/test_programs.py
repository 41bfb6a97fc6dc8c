"""Programs of KUKA and ABB: points as they are declared and driven to, and what was measured at them."""

import numpy as np
import pytest
from campaign.importers.written import complaint, imported, put

from thermal_robot.kinematics import quaternion_to_rotation

ROBOT = ("--robot", "example-robot-data:ur5", "--tool", "tool0")
AXES = np.array([[0.0, -90.0, 90.5, 0.0, 1.25e-2, 0.0], [-12.3, -70, 80, 5, 60, -179.9], [30, -100, 95, -20, -35, 10],
                 [7, -60, 70, 15, -20, 40]])  # fmt: skip
PLACES = np.array([[812.5, -3.25, 1200.0], [700, 100, 900], [650.125, -200, 800], [500, 30, 1000]])
TURNS = np.array([[10.0, 20.0, -30.0], [0, 90, 0], [-170, 5, 3], [1, 2, 3]])
NAMES = ("P1", "P2", "corner", "P10")


def kuka_dat(kind: str) -> str:
    keys = [f"A{k}" for k in range(1, 7)] if kind == "E6AXIS" else list("XYZABC")
    figures, rest = (AXES, "") if kind == "E6AXIS" else (np.hstack([PLACES, TURNS]), ",S 2,T 35")
    rows = [
        f"DECL {kind} X{name}={{{','.join(f'{key} {value:.6g}' for key, value in zip(keys, row, strict=True))}{rest},"
        f'E1 0.0,E2 0.0}}\nDECL FDAT F{name}={{TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " "}}'
        for name, row in zip(NAMES, figures, strict=True)
    ]
    head = "&ACCESS RVP\nDEFDAT  CALIB PUBLIC\nEXT  BAS (BAS_COMMAND  :IN,REAL  :IN )\n"
    head += "TOOL_DATA[1]={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0}\n"
    head += "LOAD_DATA[1]={M 5.0,CM {X 0.0,Y 0.0,Z 9.0,A 0,B 0,C 0}}\n"
    return head + "\n".join(rows) + "\n;DECL E6AXIS XOLD={A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\nENDDAT\n"


def bracket(values) -> str:
    return "[" + ",".join(f"{value:.9g}" for value in values) + "]"


EXTERNAL = "[9E9,9E+09,9E9,9E9,9E9,9E9]"
QUATERNIONS = np.array([[0.5, 0.5, -0.5, 0.5], [1, 0, 0, 0], [0, 0, 0.6, 0.8], [0, 1, 0, 0]])


def rapid(kind: str, moves: str = "") -> str:
    head = (
        "MODULE calib\n  PERS tooldata t1:=[TRUE,[[114.7,0,121.3],[0.92,0,0.38,0]],[0.1,[40,0,50],[1,0,0,0],0,0,0]];\n"
    )
    rows = []
    for name, axes, place, turn in zip(NAMES, AXES, PLACES, QUATERNIONS, strict=True):
        told = bracket(axes) if kind == "jointtarget" else f"{bracket(place)},{bracket(turn)},[0,-1,0,4]"
        remark = f"! a comment; of any kind := [[1,2,3,4,5,6],{EXTERNAL}]"
        rows.append(f"  LOCAL CONST {kind} {name}:= [{told},{EXTERNAL}];  {remark}")
    return head + "\n".join(rows) + f"\nPROC main()\n{moves}ENDPROC\nENDMODULE\n"


@pytest.fixture
def taken(tmp_path, capsys):
    """Import files of the folder with a UR5, as it is read again."""
    pytest.importorskip("example_robot_data")
    return lambda format, *files: imported(capsys, tmp_path, format, *files, *ROBOT, robot=False)[0]


MEASURED = "point;X;Y;Z\n" + "\n".join(";".join([n, *map(str, p)]) for n, p in zip(NAMES, PLACES, strict=True)) + "\n"


@pytest.mark.parametrize(("format", "name", "text"), [
    ("kuka", "c.dat", kuka_dat("E6AXIS")),
    ("kuka", "C.DAT", kuka_dat("E6AXIS").lower()),
    ("rapid", "c.mod", rapid("jointtarget")),
])  # fmt: skip
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (2, 0, 0, 3, 1)])
def test_axes_and_a_table_are_joined_by_the_names_of_points(tmp_path, taken, format, name, text, order):
    header, *lines = MEASURED.split("\n")[:-1]
    (tmp_path / name).write_text(text)
    (tmp_path / "m.csv").write_text("\n".join([header, *(lines[k] for k in order)]))
    campaign = taken(format, name, "m.csv")
    np.testing.assert_allclose(np.rad2deg(campaign.q), AXES[list(order)], atol=1e-9)
    np.testing.assert_allclose(1e3 * campaign.position, PLACES[list(order)], atol=1e-9)
    assert campaign.labels["pose"].tolist() == [NAMES[k] for k in order]


@pytest.mark.parametrize(("format", "axes", "places", "ending"), [
    ("kuka", kuka_dat("E6AXIS"), kuka_dat("E6POS"), "dat"), ("rapid", rapid("jointtarget"), rapid("robtarget"), "mod"),
])  # fmt: skip
def test_places_of_a_second_program_were_measured(tmp_path, taken, format, axes, places, ending):
    (tmp_path / f"a.{ending}").write_text(axes)
    (tmp_path / f"p.{ending}").write_text(places)
    campaign = taken(format, f"p.{ending}", f"a.{ending}")
    np.testing.assert_allclose(1e3 * campaign.position, PLACES, atol=1e-9)
    turned = quaternion_to_rotation(campaign.orientation)
    if format == "rapid":
        np.testing.assert_allclose(campaign.orientation[0], QUATERNIONS[0], atol=1e-12)
        return
    a, b, c = np.deg2rad(TURNS[0])
    # A about Z, then B about the new Y, then C about the new X: where the tool's x axis points follows from A and B
    np.testing.assert_allclose(turned[0][:, 0], [np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), -np.sin(b)], atol=1e-12)
    np.testing.assert_allclose(turned[0][2, 1:], [np.cos(b) * np.sin(c), np.cos(b) * np.cos(c)], atol=1e-12)


def test_a_program_tells_the_order_and_may_hold_points_itself(tmp_path, taken):
    (tmp_path / "c.dat").write_text(kuka_dat("E6AXIS"))
    moves = [
        "PTP Xcorner C_PTP",
        ";FOLD PTP P1",
        "SPTP XP1 WITH $VEL_AXIS[1]=1",
        "PTP_REL {A1 5}",
        "$BASE={X 1,Y 2,Z 3}",
    ]
    moves += ["PTP {A1 1.5,A2 -80,A3 70,A4 0,A5 -5E1,A6 +.5}", "END"]
    (tmp_path / "c.src").write_text("\n".join(["DEF c()", *moves]))
    (tmp_path / "m.csv").write_text("x,y,z\n1,2,3\n4,5,6\n7,8,9.5\n")
    campaign = taken("kuka", "c.src", "m.csv")
    np.testing.assert_allclose(np.rad2deg(campaign.q), [AXES[2], AXES[0], [1.5, -80, 70, 0, -50, 0.5]], atol=1e-9)
    moves = ["corner,v200,fine,t1;", "P1\\NoEOffs, v1, z5, t1;", f"[{bracket(AXES[3])},{EXTERNAL}]\\ID:=0,v1,fine,t1;"]
    (tmp_path / "c.mod").write_text(rapid("jointtarget", "".join(f"MoveAbsJ {move}\n" for move in moves)))
    campaign = taken("rapid", "c.mod", "m.csv")
    np.testing.assert_allclose(np.rad2deg(campaign.q), AXES[[2, 0, 3]], atol=1e-9)


def test_places_between_axes_are_passed_over(tmp_path, taken):
    both = kuka_dat("E6AXIS").replace("ENDDAT", "DECL E6POS XP9={X 1,Y 2,Z 3,A 4,B 5,C 6}\nENDDAT")
    (tmp_path / "c.dat").write_text(both)
    (tmp_path / "m.csv").write_text(MEASURED)
    np.testing.assert_allclose(np.rad2deg(taken("kuka", "m.csv", "c.dat").q), AXES, atol=1e-9)


def test_an_array_of_targets(tmp_path, taken):
    rows = ",\n".join(f"[{bracket(axes)}, {EXTERNAL}]" for axes in AXES)
    (tmp_path / "c.mod").write_text(f"MODULE m\nCONST jointtarget cal{{4}}:=[{rows}];\nENDMODULE\n")
    (tmp_path / "m.csv").write_text(MEASURED)
    np.testing.assert_allclose(np.rad2deg(taken("rapid", "c.mod", "m.csv").q), AXES, atol=1e-9)


@pytest.mark.parametrize("files", [("p.dat", "m.csv"), ("a.dat",), ("a.dat", "a.dat"), ("gone.dat", "m.csv")])
def test_places_are_no_commands(tmp_path, capsys, files):
    for name, kind in (("a", "E6AXIS"), ("p", "E6POS")):
        (tmp_path / f"{name}.dat").write_text(kuka_dat(kind))
    (tmp_path / "m.csv").write_text(MEASURED)
    pytest.importorskip("example_robot_data")
    said = complaint(capsys, tmp_path, "kuka", *files, *ROBOT, robot=False)
    assert "gone.dat: there is no such file" in said or "a place tells no posture" in said


def test_another_chain_than_six_axes_names_its_columns(tmp_path, capsys):
    mapping = '[columns]\njoints = ["A6", "A1", "E1", "A2"]\n'
    put(tmp_path, a__dat=kuka_dat("E6AXIS"), m__csv=MEASURED, m__toml=mapping)
    campaign, _ = imported(capsys, tmp_path, "kuka", "a.dat", "m.csv", "--mapping", "m.toml")
    assert campaign.robot.n == 4
    np.testing.assert_allclose(np.rad2deg(campaign.q[:, 3]), AXES[:, 1], atol=1e-9)
