"""The page's numbers and tables: each candidate with what is known of it, each row set aside with its errors."""

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from thermal_robot.report.page import effects_table, extremes_table, numbers, outliers_table


def cells(table):
    """Rows of a table, as the plain texts of their cells."""
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in table.split("<tr")[1:]]
    return [[unescape(re.sub(r"<[^>]+>", "", cell)) for cell in row] for row in rows if row]


def plain(html):
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", html)).replace("\N{NO-BREAK SPACE}", " ")).strip()


def test_the_big_numbers_share_unit_and_decimals(case):
    shown = re.findall(r"<b>(.*?)</b>", numbers(case("confounded")))
    assert shown == ["2.410 mm", "0.028 mm", "99.5 %"]
    said = plain(numbers(case("confounded")))
    assert "orientation 1.040 mrad" in said
    assert "noise floor 0.026 mm" in said
    assert "95 % interval 99.0 to 99.7 % 2.430 mm → 0.030 mm" in said
    assert "orientation" not in numbers(case("found"))


def test_a_number_is_never_parted_from_its_per_cent_sign(case):
    assert not re.search(r"\d %</span>", numbers(case("found")))


def test_every_candidate_has_a_row_with_status_probability_and_share(case):
    diagnosis = case("found")
    rows = {row[0]: row[1:] for row in cells(effects_table(diagnosis))}
    assert {f.name for f in diagnosis.effects} <= set(rows)
    assert rows["thermal_elongation"] == ["found", "> 99.9 %", "96.2 % (94.1 to 97.4 %)"]
    assert rows["geometric"] == ["not found", "< 0.1 %", "−3.1 % (−6.0 to 0.2 %)"]
    assert rows["backlash"] == ["not testable", "needs approach.<joint>"]
    assert rows["strain per kelvin of forearm_link"] == ["23.10 ± 0.89 µm/(m·K)"]


def test_what_was_found_stands_above_what_was_not(case):
    diagnosis = case("confounded")
    table = effects_table(replace(diagnosis, effects=diagnosis.effects[::-1]))
    places = [table.index(f">{f.name}<") for f in diagnosis.effects]
    statuses = [f.status for _, f in sorted(zip(places, diagnosis.effects, strict=True), key=lambda pair: pair[0])]
    order = ["found", "confounded", "not_found", "not_testable"]
    assert statuses == sorted(statuses, key=order.index)


def test_details_are_told_only_of_effects_that_have_some(case):
    table = effects_table(case("confounded"))
    assert table.count("tr-details") == 3
    said = plain(table)
    assert "these data cannot tell it from base_frame" in said
    assert "the 6 most significant of 35 parameters:" in said
    assert "and 29 more, listed in the JSON" in said
    assert "not determined by these data: translation z of base_link" in said


def test_what_is_inside_another_effect_has_a_line_and_its_numbers(case):
    said = plain(effects_table(case("contained")))
    assert "its part of geometric" in said
    assert "2 not seen apart from the others or the frames" in said


def test_a_law_says_what_it_follows(law_case):
    assert "follows time (step); step 0.1700 ± 0.0060 mrad; usually warming, or something that slips" in plain(
        effects_table(law_case())
    )


def test_names_are_escaped(case):
    base = case("found")
    table = effects_table(replace(base, effects=(replace(base.effects[0], name="<b>&"),)))
    assert "&lt;b&gt;&amp;" in table
    assert "<b>" not in table


def test_rows_set_aside_stand_in_a_table(case):
    diagnosis = case("found")
    table = outliers_table(diagnosis)
    assert "remainder (mm)" in table
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in table.split("<tr>")[2:]]
    assert [row[0] for row in rows] == ["17", "80"]
    row = diagnosis.rows.remainder[list(diagnosis.rows.rows).index(17)] * 1e3
    assert [float(v) for v in rows[0][3:6]] == pytest.approx(row, abs=0.006)
    assert float(rows[0][2]) == pytest.approx((row**2).sum() ** 0.5, abs=0.006)


def test_many_rows_set_aside_are_cut_off(case, make_rows):
    aside = tuple(range(2, 102))
    page = outliers_table(replace(case("found"), outliers=aside, rows=make_rows(300, aside=aside)))
    assert page.count("<tr>") == 1 + 40
    assert "and 60 more, listed in the JSON" in page


def test_the_largest_error_of_a_row_decides_the_unit_of_all(case, make_rows):
    rows = make_rows(20, aside=(5,))
    small = replace(rows, gap=rows.gap * 1e-2, remainder=rows.remainder * 1e-2)
    diagnosis = replace(case("found"), outliers=(5,))
    assert "gap (mm)" in outliers_table(replace(diagnosis, rows=rows))
    assert "gap (µm)" in outliers_table(replace(diagnosis, rows=small))


def test_extremes_are_those_of_the_rows(case):
    """A gap of 3, 4 and 0 µm in half of the rows and 30, 40 and 0 in the other: rms and largest are known."""
    diagnosis = case("found")
    gap = np.tile([[3e-6, 4e-6, 0.0], [30e-6, 40e-6, 0.0]], (60, 1))
    rows = replace(diagnosis.rows, gap=gap, remainder=0.1 * gap, outliers=np.zeros(120, dtype=bool))
    told = {row[0]: row[1:] for row in cells(extremes_table(replace(diagnosis, rows=rows)))}
    assert told["gap in µm"][:3] == ["rms", "95 % below", "largest"]
    assert told["all rows, before"] == ["35.5", "50.0", "50.0", "21.3", "28.4", "0"]
    assert told["all rows, after"][2] == "5.00"


def test_rows_set_aside_are_no_extremes(case):
    diagnosis = case("found")
    gap = np.full((120, 3), 1e-6)
    gap[7] = 1.0
    aside = np.arange(120) == 7
    distance = np.full(120, 1e-6)
    held = {"held_out_before": distance, "held_out_after": distance}
    rows = replace(diagnosis.rows, gap=gap, remainder=gap, outliers=aside, **held)
    told = cells(extremes_table(replace(diagnosis, rows=rows)))
    assert [row[3] for row in told[1:]] == ["1.73", "1.73", "1.00", "1.00"]
