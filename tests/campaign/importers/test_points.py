"""Points by name, in every layout that SpatialAnalyzer exports, joined with the commands of the robot."""

import numpy as np
import pytest
from campaign.importers.written import COMMANDS, complaint, imported, put

UNITS = ("--angle-unit", "rad", "--length-unit", "mm")
PLACES = {"P1": "1000.25 0.0 500.5", "P2": "900.0 100.0 510.0", "P3": "800.0 200.0 520.0"}


def named(names=("P1", "P2", "P3")):
    header, *rows = COMMANDS.split()
    return "\n".join([f"point,{header}", *(f"{name},{row}" for name, row in zip(names, rows, strict=True))])


@pytest.mark.parametrize(
    "line",
    ["{n} {p}", "B {n} {p}", "A B {n} {p}", "A, B, {n}, {c}", "{n},{c}", "A\tB\t{n}\t{t}", "A B {n} {p} 0.01"],
    ids=["target", "group target", "collection group target", "commas", "target, commas", "tabs", "uncertainty behind"],
)  # fmt: skip
def test_every_layout_gives_the_same_campaign(tmp_path, capsys, line):
    order = ["P3", "P1", "P2", "P1"]
    lines = ["// SA 2024.1, frame A::WORLD", "// X Y Z"]
    lines += [
        line.format(n=n, p=PLACES[n], c=PLACES[n].replace(" ", ", "), t=PLACES[n].replace(" ", "\t")) for n in order
    ]
    folder = put(tmp_path, points__txt="\n".join(lines), commands__csv=named())
    campaign, _ = imported(capsys, folder, "points", "points.txt", "commands.csv", *UNITS)
    np.testing.assert_allclose(1e3 * campaign.position[:, 0], [800, 1000.25, 900, 1000.25])
    np.testing.assert_allclose(campaign.q[:, 0], [0.5, 0.1, -0.1, 0.1])
    assert campaign.labels["pose"].tolist() == order


def test_names_that_are_numbers(tmp_path, capsys):
    points = "".join(f"Main {k + 1} {place}\n" for k, place in enumerate(PLACES.values()))
    folder = put(tmp_path, p__txt=points, c__csv=named("123"))
    campaign, _ = imported(capsys, folder, "points", "p.txt", "c.csv", *UNITS)
    assert campaign.labels["pose"].tolist() == ["1", "2", "3"]
    np.testing.assert_allclose(campaign.q[:, 0], [0.1, -0.1, 0.5])


def test_a_list_with_a_header(tmp_path, capsys):
    points = "Name;X;Y;Z;RMS\nP2;900,5;100;510;0,01\nP1;1000;0;500;0,01\nP3;800;200;520;0,02\n"
    folder = put(tmp_path, p__csv=points, c__csv=named())
    campaign, out = imported(capsys, folder, "points", "p.csv", "c.csv", *UNITS)
    np.testing.assert_allclose(1e3 * campaign.position[:, 0], [900.5, 1000, 800])
    assert "columns left out: 'RMS'" in out


def test_points_without_names_stand_in_the_order_of_the_commands(tmp_path, capsys):
    points = "\n".join(PLACES.values())
    folder = put(tmp_path, p__txt=points, c__csv=COMMANDS)
    campaign, out = imported(capsys, folder, "points", "p.txt", "c.csv", *UNITS)
    np.testing.assert_allclose(1e3 * campaign.position[:, 2], [500.5, 510, 520])
    assert "joined in their order" in out


def test_what_was_not_commanded_or_not_measured_is_told(tmp_path, capsys):
    points = "".join(f"{name} {PLACES[name]}\n" for name in ("P1", "P2")) + f"P9 {PLACES['P3']}\n"
    more = named() + "\nP4,0.7,0.1,0.01,0.2\n"
    folder = put(tmp_path, p__txt=points + f"P4 {PLACES['P3']}\n", c__csv=more)
    _, out = imported(capsys, folder, "points", "p.txt", "c.csv", *UNITS)
    assert "1 points left out, not commanded: 'P9'; 1 commands left out, not measured: 'P3'" in out


def test_points_that_do_not_belong_to_the_commands(tmp_path, capsys):
    points = "\n".join(f"Q{name} {place}" for name, place in PLACES.items())
    folder = put(
        tmp_path, p__txt=points, c__csv=named(), twice__csv=named(("P1", "P1", "P2")), two__txt="1.0 2.0 3.0\n"
    )
    said = complaint(capsys, folder, "points", "p.txt", "c.csv", *UNITS)
    assert "p.txt, column 'target': no point has a name that stands in c.csv; found 'QP1', 'QP2', 'QP3'" in said
    (folder / "p.txt").write_text("\n".join(f"{name} {place}" for name, place in PLACES.items()))
    said = complaint(capsys, folder, "points", "p.txt", "twice.csv", *UNITS)
    assert "twice.csv, row 3, column 'point': a point is commanded more than once; found 'P1', as in row 2" in said
    assert "found 1 and 3 rows" in complaint(capsys, folder, "points", "two.txt", "c.csv", *UNITS)
    (folder / "p.txt").write_text("P1 1 2 3\nP2 1 2\n")
    assert "p.txt: is no list of points" in complaint(capsys, folder, "points", "p.txt", "c.csv", *UNITS)
    assert "found 1, expected POINTS COMMANDS.csv" in complaint(capsys, folder, "points", "p.txt", *UNITS)
    (folder / "p.txt").write_text("\n".join(f"{name} {place}" for name, place in PLACES.items()))
    assert "no angle_unit is stated" in complaint(capsys, folder, "points", "p.txt", "c.csv")


GROUPS = '[table]\nkey = "group"\ntargets = "target"\n'
SHIFTS = {"T1": (0.0, 0.0), "T2": (80.0, 0.0), "T3": (0.0, 60.0), "T4": (70.0, 50.0)}
"""Of the targets, along x and y, mm."""


def lines(*visits, without=()):
    """Lines of a list: group, target, x, y and z, each target shifted by its own."""
    told = []
    for visit in visits:
        x, y, z = map(float, PLACES[visit].split())
        told += [f"{visit} {t} {x + a} {y + b} {z}" for t, (a, b) in SHIFTS.items() if (visit, t) not in without]
    return "\n".join(told) + "\n"


def mapped(folder, **files):
    return put(folder, mapping__toml=GROUPS, c__csv=named(), **files)


def test_targets_of_a_group_make_one_row(tmp_path, capsys):
    folder = mapped(tmp_path, p__txt=lines("P3", "P1", "P2", "P1", without={("P2", "T2")}))
    arguments = "p.txt", "c.csv", "--mapping", str(folder / "mapping.toml")
    campaign, out = imported(capsys, folder, "points", *arguments, *UNITS)
    assert "4 targets of each pose, numbered so: 'T1', 'T2', 'T3', 'T4'" in out
    assert campaign.labels["pose"].tolist() == ["P3", "P1", "P2", "P1"]
    np.testing.assert_allclose(campaign.q[:, 0], [0.5, 0.1, -0.1, 0.1])
    first = 1e-3 * np.array([800, 1000.25, 900, 1000.25])
    expected = first[:, None] + 1e-3 * np.array([along for along, _ in SHIFTS.values()])
    expected[2, 1] = np.nan
    np.testing.assert_allclose(campaign.targets.points[..., 0], expected)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("\n".join(f"{name} T1 {place}" for name, place in PLACES.items()), "a single target of each pose; found 'T1'"),
        ("\n".join(f"{name} {place}" for name, place in PLACES.items()), "column 'group': there is no such column"),
    ],
)
def test_a_list_without_several_targets_is_refused(tmp_path, capsys, points, message):
    folder = mapped(tmp_path, p__txt=points)
    arguments = "p.txt", "c.csv", "--mapping", str(folder / "mapping.toml")
    assert message in complaint(capsys, folder, "points", *arguments, *UNITS)


def test_a_table_names_the_columns_of_its_targets_instead(tmp_path, capsys):
    folder = mapped(tmp_path, p__csv="X,Y,Z\n1,2,3\n")
    arguments = "p.csv", "c.csv", "--mapping", str(folder / "mapping.toml")
    assert "column 'table.targets': is for lists of points" in complaint(capsys, folder, "table", *arguments, *UNITS)
