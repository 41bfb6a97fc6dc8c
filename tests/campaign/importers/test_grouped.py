"""Several targets of one pose in a list of points: a line each, one row of the campaign."""

import numpy as np
import pytest
from campaign.importers.test_points import PLACES, UNITS, named
from campaign.importers.written import complaint, imported, put

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
