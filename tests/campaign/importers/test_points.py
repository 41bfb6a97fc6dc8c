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
