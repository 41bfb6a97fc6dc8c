"""The pages say the same as the text, stand alone, and trust no name."""

import base64
import hashlib
import json
import re
import subprocess
import sys
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from importlib.metadata import PackageNotFoundError
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest
from compared import diagnosed, moved
from lxml.html import document_fromstring
from report.cases import CASES, HARD, case, rows, with_first
from report.every_page import EVERY, FILES, WHEN
from report.every_page import page as page_of
from report.fleets import EMPTY, SUMMARY
from scipy.spatial.transform import Rotation
from wear_cases import by_hand

import thermal_robot as tr
from thermal_robot import report
from thermal_robot.correction.holding import FORMATS, expectation
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.values import (
    DataFault,
    Dependence,
    Estimate,
    Finding,
    Location,
    Misfit,
    Unexplained,
    Where,
)
from thermal_robot.report import fragment, html, page, tables, words
from thermal_robot.report.drawing import BEFORE, INK, Drawing

EMPTY_TAGS = {"meta", "link", "br", "img", "input", "hr"}
UGLY = "$a_1$ <script>alert('x')</script> & \"quote\" \\frac"


class Reader(HTMLParser):
    """Collects text, tags, references and identifiers, and checks that every tag is closed."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.text, self.references, self.ids = [], [], [], [], []
        self.feed(re.sub("</?code>", "", page))  # options stand within sentences
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag not in EMPTY_TAGS:
            self.open.append(tag)
        for name, value in attrs:
            if name in ("href", "src", "xlink:href", "srcset", "action", "data"):
                self.references.append(value)
            self.references += re.findall(r"url\(([^)]*)\)", value or "")
            if name == "id":
                self.ids.append(value)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in EMPTY_TAGS:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] != "style":
            self.text.append(data)

    @property
    def words(self):
        return re.sub(r"\s+", " ", " ".join(self.text))


def cells(table):
    """Rows of a table in HTML, as the plain texts of their cells."""
    found = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, flags=re.S) for row in table.split("<tr")[1:]]
    return [[Reader(cell).words for cell in row] for row in found if row]


def section(page, heading):
    """The HTML below a heading."""
    return page.partition(f"<h2>{heading}</h2>")[2].partition("</section>")[0]


def headings(page):
    return re.findall(r"<h2>(.*?)</h2>", page)


@pytest.fixture(params=[html, fragment])
def write(request):
    return request.param


EACH_COMMIT = ("found_piece", "compare_3", "fleet", "wear")


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=[pytest.mark.slow] * (k not in EACH_COMMIT)) for k in ("found_piece", *EVERY)]
)
def test_a_page_stands_alone_its_references_find_their_targets_and_equal_results_give_equal_pages(kind):
    shown = page_of(kind) if kind in EVERY else fragment(case("found"))
    assert "//" not in re.sub(r"data:image/png;base64,[\w+/=\s]*", "", shown)
    assert "@import" not in shown
    reader = Reader(shown)
    assert all(r.startswith(("#", "data:image/png;base64,")) for r in reader.references)
    assert len(reader.ids) == len(set(reader.ids))
    assert {r[1:] for r in reader.references if r.startswith("#")} <= set(reader.ids)
    if kind in EVERY:
        assert shown.startswith("<!DOCTYPE html>")
        assert "script" not in reader.tags
        assert shown.count(WHEN) == 1
        assert shown == page_of(kind)
        assert kind in ("fleet", "blind") or all(f"<code>{digest}</code>" in shown for digest in FILES.values())


@pytest.mark.parametrize("kind", ["found", "compare_3", "fleet", "wear", "motion"])
def test_a_number_of_a_page_stays_with_its_unit(kind):
    told = "|".join(Reader(page_of(kind)).text)
    assert re.search(r"\d\u00a0(µm|mrad|%)", told)
    assert not re.search(r"\d (µm|mrad|%|± )", told)


def test_every_name_is_escaped(write):
    """A name that is no name stands wherever a name can stand."""
    base = case("unexplained")
    parameters = (Estimate(UGLY, 1.0, 0.1, UGLY, True), Estimate(UGLY, None, None, UGLY, False))
    effects = (
        replace(base.effects[0], name=UGLY, locations=(Location("link", UGLY, 0.4),), parameters=parameters),
        Finding(UGLY + "2", "not_testable", needs=(UGLY,)),
        Finding(UGLY + "3", "confounded", 0.5, None, None, confounded_with=(UGLY,)),
    )
    shown = write(
        case(
            "unexplained", **dict.fromkeys(("campaign", "robot", "tool_frame", "summary", "advice"), UGLY),
            joint_names=(UGLY, *base.joint_names[1:]), separates=((UGLY, "drift"),), warnings=(UGLY,), verdict=(UGLY,),
            gap={"noise_source": UGLY, "held_out": {"scheme": UGLY}}, effects=effects,
            where=Where({"x": 1.0, "y": 0.0, "z": 0.0}, {UGLY: 0.4}, {UGLY: 0.3}, {UGLY: 0.2}),
            unexplained=Unexplained(
                True, 1e-5, 0.001, (UGLY,), (Location("joint", UGLY, 0.9),), (Dependence(UGLY, 0.001),)
            ),
            rows={"covariates": {UGLY: base.rows.covariates["time"]}},
        )
    )  # fmt: skip
    assert "<script" not in shown
    assert "script" not in Reader(shown).tags
    assert shown.count("&lt;script&gt;") > 5
    assert UGLY in re.sub(r"\s+", " ", unescape(shown))


def all_words(d):
    """What words that the text is made of, too, tell of a diagnosis."""
    yield from (d.summary, d.advice, *d.warnings, *words.details(d), *words.facts(d).values(), *words.sentences(d))
    yield from (words.noise(d), words.hardest(d), words.with_aside(d), words.one_sigma(d))
    yield from (said for pair in words.about(d.about).items() for said in pair)
    for finding in d.effects:
        before, shown, after = words.described(finding, d)
        yield from (finding.name, *(line for line, _ in before + after), *(cell for row in shown for cell in row))


@pytest.mark.usefixtures("no_drawing")
@pytest.mark.parametrize("kind", [*CASES, "misfit"])
def test_the_page_says_all_that_the_text_says(kind):
    hard = {"gap": {"schemes": (HARD,), "hardest": HARD}, "left_out": ("drift",)} if kind == "law" else {}
    told = case(kind, **hard) if hard else EVERY[kind][1]()
    shown = Reader(html(told)).words.replace(words.NO_BREAK, " ")
    every = list(all_words(told)) if told.usable else [told.summary, *told.warnings, *words.facts(told).values()]
    assert [said for said in every if " ".join(said.replace(words.NO_BREAK, " ").split()) not in shown] == []
    assert ("held out by temperature" in shown) is bool(hard)


@pytest.mark.usefixtures("no_drawing")
def test_every_candidate_has_a_row_the_found_above_the_rest(write):
    shown = {row[0]: row[1:] for row in cells(write(case("found")).partition("Every effect")[2])}
    assert {f.name for f in case("found").effects} <= set(shown)
    assert shown["thermal_elongation"] == ["found", "> 99.9 %", "96.2 % (94.1 to 97.4 %)"]
    assert shown["geometric"] == ["not found", "< 0.1 %", "−3.1 % (−6.0 to 0.2 %)"]
    assert shown["backlash"] == ["not testable", "needs approach.<joint>"]
    assert shown["strain per kelvin of forearm_link"] == ["23.10 ± 0.89 µm/(m·K)"]
    base = case("confounded")
    table = write(replace(base, effects=base.effects[::-1])).partition("Every effect")[2]
    places = {table.index(f">{f.name}<"): f.status for f in base.effects}
    order = ["found", "confounded", "not_found", "not_testable"]
    assert [places[at] for at in sorted(places)] == sorted(places.values(), key=order.index)


@pytest.mark.usefixtures("no_drawing")
def test_what_is_unexplained_is_flagged_and_what_is_not_determined_has_no_number(write):
    wrong = Estimate("strain of nothing", 7.777e-6, 1.111e-6, "1/K", False)
    shown = write(with_first("found", parameters=(wrong,)))
    told = Reader(shown).words
    assert all(
        said in told for said in ("412 µm", "28 µm", "99.5 %", "not determined by these data: strain of nothing")
    )
    assert not re.search(r"7\.7[78]|1\.1[12]", told)
    assert 'class="tr-flag"' not in shown
    assert 'class="tr-flag"' in write(case("unexplained"))


def test_the_page_is_a_document_with_every_section_that_has_content(written):
    shown = written(html, "found")
    assert "<title>Diagnosis of hall_3_morning</title>" in shown
    assert headings(shown) == [
        "How far", "Which", "Where", "Unexplained", "Next", "Set aside", "Warnings", "What the words mean",
    ]  # fmt: skip
    assert shown.count('role="img"') == 5
    assert "prefers-color-scheme: dark" in shown
    assert "size: A4" in shown
    assert "script-src 'none'" in shown
    assert 'id="tr-arm"' not in shown  # nothing is known of its places
    assert shown.index("</style>") < shown.index("<h2>") < shown.index("</main>")
    assert f"{case('found').advice} to tell apart: thermal_elongation, drift" in Reader(shown).words
    assert headings(written(html, "nothing")) == ["How far", "Which", "Where", "Unexplained", "What the words mean"]


def test_cells_of_a_fragment_bring_their_style_along(written):
    """JupyterLab's and VS Code's style sheets align cells right, stripe rows, and fix the widths of columns."""
    piece = document_fromstring(written(fragment, "found"))
    styles = {
        tag: [dict(part.split(": ") for part in one.get("style").split("; ")) for one in piece.iter(tag)]
        for tag in ("table", "tr", "th", "td")
    }
    assert all(len(found) > 1 for found in styles.values())
    assert {style["table-layout"] for style in styles["table"]} == {"auto"}
    assert {style["background"] for tag in ("tr", "th", "td") for style in styles[tag]} == {"none"}
    for tag in ("th", "td"):
        for one, style in zip(piece.iter(tag), styles[tag], strict=True):
            assert style["text-align"] == ("right" if one.get("class") == "tr-n" else "left")
    assert {style["width"] for style in styles["table"]} == {
        "100%",
        "auto",
    }  # those within a cell are as wide as need be
    page = document_fromstring(written(html, "found"))
    assert not [one for tag in styles for one in page.iter(tag) if one.get("style")]


def test_a_notebook_shows_the_fragment(written):
    shown = case("found")._repr_html_()
    assert shown == written(fragment, "found")  # drawn anew: equal diagnoses give equal pieces
    assert shown.startswith('<div class="thermal-robot">')
    assert "<html" not in shown
    rules = re.search(r"<style>(.*?)</style>", shown, re.DOTALL)[1]
    selectors = [found.strip() for found in re.findall(r"([^{}]+)\{", rules)]
    assert all(".thermal-robot" in selector for selector in selectors if not selector.startswith("@media"))


@pytest.mark.slow
def test_a_long_campaign_stays_small():
    assert len(html(case("unexplained", samples=12000, rows=rows(12000)))) < 2_000_000


@pytest.mark.usefixtures("no_drawing")
def test_the_footer_tells_libraries_files_and_the_date_that_was_given(monkeypatch):
    bare, dated = html(case("found")), html(case("found"), "1 April 2031 <>", {"a<b.csv": "0a1b"})
    assert re.search(r"<footer>thermal-robot( [\w.+]+)?(, (pin|numpy|scipy) [\w.+]+)+</footer>", bare)
    assert f"numpy {np.__version__}" in bare
    assert "1 April 2031 &lt;&gt;</footer>" in dated
    assert "<li>a&lt;b.csv <code>0a1b</code></li></ul>" in dated

    def absent(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr(page, "version", absent)  # a source tree that is not installed
    assert page.signature("1 May") == "thermal-robot, 1 May"


@pytest.mark.usefixtures("no_drawing")
def test_a_law_is_drawn_where_its_fit_is_at_hand(monkeypatch):
    drawn = []
    monkeypatch.setattr(Diagnosis, "explain", lambda self, name: drawn.append(name) or Drawing(1.0, 1.0))
    monkeypatch.setattr(Diagnosis, "arm", lambda *_: None)
    monkeypatch.setattr(tables, "frames", lambda _: {"label": "", "heads": (), "rows": ()})
    shown = html(case("law", fit=object(), model=SimpleNamespace(spread=None, files=())))
    assert drawn == ["discovered.1"]
    assert shown.count('role="img"') == 6
    assert html(case("law")).count('role="img"') == 5


def test_of_a_table_at_fault_nothing_is_said_of_the_robot(write, written):
    """Positions in mm that were declared as m, in two rows."""
    fault = DataFault(("metric unit",), "positions stand in mm, not in m", "correct length_unit", 413.0, 8e-5, (3, 7))
    base = case("unexplained", warnings=("the target lies 62.6 m away",), misfit=Misfit(fault))
    misfit = replace(base, summary=report.headline(base), advice=report.advice(base))
    shown = write(misfit)
    words = Reader(shown).words
    for said in (misfit.summary, misfit.advice, "robot and table do not belong together", "rows 3, 7", "62.6 m away"):
        assert said in words
        assert said in re.sub(r"\s+", " ", report.text(misfit))
    assert words.count(misfit.advice) == 1
    assert "<svg" not in shown
    assert "<table" not in shown
    sound = Reader(written(write, "unexplained")).words
    for told in ("Gap before", "412 µm", "thermal_elongation", "elbow_joint", "nexplained"):
        assert told in sound
        assert told not in words
    whole = html(misfit, files={"campaign.toml": "0123abcd"})
    assert headings(whole) == ["Next", "Warnings"]
    assert "0123abcd</code></li></ul>" in whole
    assert "script-src 'none'" in whole


def test_the_big_numbers_share_unit_and_decimals():
    (_, _, before, turned), (_, _, after, (_, floor)), (_, _, held, (bounds, pair)) = tables.numbers(case("confounded"))
    assert (before, after, held) == ("2.410 mm", "0.028 mm", "99.5 %")
    assert (turned, floor) == (["orientation 1.040 mrad"], "noise floor 0.026 mm")
    assert (bounds, pair) == ("95 % interval 99.0 to 99.7 %", "2.430 mm → 0.030 mm")
    assert tables.numbers(case("found"))[0][3] == [""]


def test_rows_set_aside_stand_in_a_table_whose_largest_error_decides_the_unit():
    base = case("found")
    table, more = tables.set_aside(base)
    assert ("remainder (mm)" in table["heads"], more) == (True, 0)
    assert [row[0] for row in table["rows"]] == ["row 17", "row 80"]
    row = base.rows.remainder[list(base.rows.rows).index(17)] * 1e3
    told = [float(v.replace("−", "-")) for v in table["rows"][0][2:]]
    assert told == pytest.approx([np.linalg.norm(row), *row], abs=0.006)
    aside = tuple(range(2, 102))
    table, more = tables.set_aside(case("found", outliers=aside, rows=rows(300, aside=aside)))
    assert (len(table["rows"]), more) == (40, 60)
    some = rows(20, aside=(5,))
    small = replace(some, gap=some.gap * 1e-2, remainder=some.remainder * 1e-2)
    for of, unit in ((some, "mm"), (small, "µm")):
        assert f"gap ({unit})" in tables.set_aside(case("found", outliers=(5,), rows=of))[0]["heads"]


def test_extremes_are_those_of_the_rows_that_were_not_set_aside():
    """A gap of 3, 4 and 0 µm in half of the rows and 30, 40 and 0 in the other: rms and largest are known."""
    gap = np.tile([[3e-6, 4e-6, 0.0], [30e-6, 40e-6, 0.0]], (60, 1))
    table = tables.extremes(case("found", rows={"gap": gap, "remainder": 0.1 * gap, "outliers": np.zeros(120, bool)}))
    assert table["heads"][:4] == ("", "rms (µm)", "95 % below (µm)", "largest (µm)")
    told = {row[0]: row[1:] for row in table["rows"]}
    assert told["all rows, before"] == ["35.5", "50.0", "50.0", "21.3", "28.4", "0"]
    assert told["all rows, after"][2] == "5.00"
    gap = np.where(np.arange(120)[:, None] == 7, 1.0, np.full((120, 3), 1e-6))
    held = dict.fromkeys(("held_out_before", "held_out_after"), np.full(120, 1e-6))
    one = {"gap": gap, "remainder": gap, "outliers": np.arange(120) == 7, **held}
    assert [row[3] for row in tables.extremes(case("found", rows=one))["rows"]] == ["1.73", "1.73", "1.00", "1.00"]
    none = tables.extremes(case("found", rows={"outliers": np.ones(120, bool), "held_out_after": np.full(120, np.nan)}))
    assert [row[0] for row in none["rows"]] == ["rows held out, before"]


def test_frames_are_those_of_the_model_and_zero_has_no_sign(demo):
    base, tool = tables.frames(demo)["rows"]
    told = [float(cell.replace("\N{MINUS SIGN}", "-")) for cell in base[1:]]
    np.testing.assert_allclose(told[:3], 1e3 * demo.model.frames.base[:3, 3], atol=5e-4)
    turn = Rotation.from_euler("xyz", told[3:], degrees=True).as_matrix()
    np.testing.assert_allclose(turn, demo.model.frames.base[:3, :3], atol=2e-6)
    assert tool[4:] == ["", "", ""], "positions say nothing of how the target is turned on the tool"
    for value in (-1e-7, -0.0, 0.0):
        frames = demo.frames.copy()
        frames.loc["base", ["x", "roll"]] = value
        row = tables.frames(SimpleNamespace(frames=frames))["rows"][0]
        assert (row[1], row[4]) == ("0.000", "0.0000")


def test_correlations_are_the_strongest_and_the_others_are_counted(demo):
    table, hidden = tables.correlations(demo)
    covariance = demo.covariance.to_numpy()
    std = np.sqrt(covariance.diagonal())
    sizes = np.abs((covariance / np.outer(std, std))[np.triu_indices(len(std), 1)])
    strong = int((sizes > 0.5).sum())
    assert len(table["rows"]) == min(strong, 10)
    assert abs(float(table["rows"][0][2].replace("\N{MINUS SIGN}", "-"))) == pytest.approx(sizes.max(), abs=0.005)
    assert hidden == f"Not shown: {len(sizes) - strong} correlations within ±0.5{hidden.partition('±0.5')[2]}"
    for count, said in ((1, ""), (3, "No two parameters have a correlation beyond ±0.5.")):
        apart = demo.covariance.iloc[:count, :count] * np.eye(count)
        table, hidden = tables.correlations(SimpleNamespace(covariance=apart))
        assert (table["rows"], hidden) == ([], said)


@pytest.mark.usefixtures("no_drawing")
def test_criteria_stand_as_they_are_printed_with_repeats_alone():
    found = case("repeated").performance
    shown = section(html(case("repeated")), "ISO 9283")
    printed = [line.split() for line in str(found).splitlines()]
    told = [cells(table) for table in re.split("<table[^>]*>", shown)[1:]]
    assert [table[0][0] for table in told] == ["pose", "pose", "pose", "pose", "path", "path"]
    assert all(row in printed for table in told for row in table)
    assert told[0][1][:5] == ["P1", "30", "3", "0.701", "0.040"]
    assert "Fewer cycles than the standard" in shown
    assert "ISO 9283" not in html(case("found"))
    many = tuple(replace(found.poses[1], pose=f"<b>{k}") for k in range(45))
    shown = section(html(case("repeated", performance={"poses": many, "paths": ()})), "ISO 9283")
    assert "<b>" not in shown
    assert ">&lt;b&gt;39</td>" in shown
    assert shown.count("and 5 more, in the JSON and the CSV.") == 1


def test_the_drawing_of_the_arm_holds_what_the_diagnosis_knows(demo):
    rows, shown = demo.rows, np.flatnonzero(~demo.rows.outliers)
    drawn = page.arm_drawing(demo)["data"]
    assert len(drawn["rows"]) == len(shown) == 116
    for row, k in zip(drawn["rows"], shown, strict=True):
        assert row["told"].startswith(f"row {rows.rows[k]}: gap ")
        np.testing.assert_allclose(row["at"], rows.position[k], atol=5.1e-5)
        np.testing.assert_allclose(row["before"], rows.gap[k, :3], rtol=5.1e-3)
        np.testing.assert_allclose(row["after"], rows.remainder[k, :3], rtol=5.1e-3)
    expected = demo.model.robot.forward(rows.q[shown])[:, :3]
    last = np.array([row["poses"] for row in drawn["rows"]]).reshape(len(shown), -1, 3, 4)[:, -1]
    np.testing.assert_allclose(last, expected, atol=5.1e-5)
    named = {place["named"] for place in (*drawn["joints"], *drawn["links"]) if place["named"]}
    joint = max(demo.where.joints, key=demo.where.joints.get)
    assert f"{joint} {100 * demo.where.joints[joint]:.1f} %" in named
    every = [p["share"] for p in (*drawn["joints"], *drawn["links"], drawn["base"], drawn["tool"])]
    assert sum(every) == pytest.approx(sum(demo.where.places.values()), abs=1e-3)
    extent = np.ptp([row["at"] for row in drawn["rows"]], axis=0).max()
    typical = np.quantile([np.linalg.norm(row["before"]) for row in drawn["rows"]], 0.95)
    assert 0.02 * extent < drawn["factor"] * typical < 0.13 * extent


@pytest.mark.usefixtures("no_drawing")
def test_the_page_of_a_fit_draws_the_arm_with_its_ends_and_runs_its_own_script_alone(demo):
    beyond = {"base": 0.18, "tool": 0.6, "instrument": 0.031, "</script><b>//": 0.0}
    shown = html(replace(demo, where=replace(demo.where, beyond=beyond), robot="</script>"))
    (kind, data), (own, code) = re.findall(r"<script([^>]*)>(.*?)</script>", shown, flags=re.S)
    assert (kind, own) == (' type="application/json" id="tr-arm-data"', "")
    values = json.loads(data)
    assert values["base"] == {"share": 0.18, "named": "base 18.0 %"}
    assert values["tool"] == {"share": 0.6, "named": "tool 60.0 %"}
    assert not set("<>&") & set(data)
    told = Reader(shown).words
    assert "60.0 % of the gap enters there" in told
    assert "At the instrument: 3.1 %, not drawn." in told
    assert "(4 set aside are not drawn)" in told
    allowed = base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
    assert f"'unsafe-inline'; img-src data:; script-src 'sha256-{allowed}'" in shown
    assert "//" not in code
    assert "<h2>The model</h2>" in shown
    assert len(shown) < 3_000_000
    nowhere = html(replace(demo, where=Where(demo.where.axes, {}, {}, {})))
    assert "No place on the arm carries a share of the gap." in nowhere
    assert "instrument:" not in nowhere


def bent(bend=1.0, width=4.0):
    drawing = Drawing(width, 2.0)
    axes = drawing.subplots()
    axes.plot([0.0, 1.0, 2.0], [0.0, bend, 0.0], color=BEFORE, marker="o")
    axes.set_title("bent", color=INK)
    return drawing


def test_a_figure_on_a_page_is_equal_for_equal_figures_and_free_of_clashes_addresses_and_fixed_colours():
    label = 'a bend & "more" <b>'
    drawn = page.svg(bent(), label)
    assert Reader(drawn).tags[0] == "svg"
    assert f'role="img" aria-label="{"a bend &amp; &quot;more&quot; &lt;b&gt;"}"' in drawn
    assert page.svg(bent(), label) == drawn
    own, other = (set(re.findall(r'\bid="([^"]+)"', text)) for text in (drawn, page.svg(bent(2.0), "another bend")))
    assert own
    assert not own & other
    wanted = set(re.findall(r'href="#([^"]+)"', drawn)) | set(re.findall(r"url\(#([^)]+)\)", drawn))
    assert wanted
    assert wanted <= own
    assert not re.search(r"//|xmlns|metadata|\b20\d\d-\d\d-\d\d", drawn)
    assert f"var(--tr-before,{BEFORE})" in drawn
    assert re.findall(rf"(?<!,){INK}", drawn) == []
    widths = [int(re.search(r"max-width:(\d+)px", page.svg(bent(width=w), ""))[1]) for w in (4.0, 8.0)]
    assert widths[1] == 2 * widths[0]


def test_the_page_of_a_comparison_is_whole_and_its_fragment_one_piece():
    names = ["before", "<script>alert(1)</script>"]
    plain = tr.compare(diagnosed(1), diagnosed(3, moved(4e-4)), names=names).to_dict()
    shown = report.comparison_html(plain)
    assert "<script" not in shown
    for told in ("zero offset, joint_3", "What changed", "Predictions", "Not compared"):
        assert told in shown
    piece = report.comparison_fragment(plain)
    assert piece.startswith('<div class="thermal-robot">')
    assert piece.count("<div") == piece.count("</div>")
    quiet = report.comparison_fragment({**plain, "changes": [], "effects": [], "not_told": []})
    assert headings(quiet) == ["What changed", "Predictions"]
    assert "<p>Nothing.</p>" in quiet


def test_the_page_of_a_fleet_holds_every_line():
    shown = report.fleet_html(SUMMARY)
    for said in ("<h1>30 campaigns of 29 robots", "hall 2", "fore_arm", "arm_07", "arm_19", "&lt;nonsense&gt;"):
        assert said in shown
    assert "<nonsense>" not in shown
    assert shown.count("<section>") == 9
    failed = report.fleet_html(EMPTY)
    assert failed.count("<section>") == 1
    assert "<svg" not in failed


def test_the_page_of_a_robot_over_time_tells_what_rings():
    shown = report.wear_html(by_hand())
    for said in (
        "zero offset, elbow jumped by +0.200",
        "2026-07-20 (2026-06-30 to 2026-08-19)".replace("-", "\u2011"),
        "cannot be compared: unknown frames hide its changes",
        "a &lt;note&gt; to know",
    ):
        assert said in shown
    assert shown.count('role="img"') == 1


def test_the_room_lists_what_it_has_and_what_is_light_stays_light():
    code = (
        "import sys; from thermal_robot import report as r; r.text, r.schema(), r.headline;"
        "print([m for m in ('matplotlib', 'jinja2', 'jsonschema') if m in sys.modules]);"
        "r.html, r.overview, r.explain_figure;"
        "print([m for m in ('matplotlib', 'matplotlib.pyplot') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines() == ["[]", "['matplotlib']"]
    assert set(report.__all__) <= set(dir(report))
    assert all(callable(getattr(report, name)) for name in report.__all__)
    with pytest.raises(AttributeError, match="no attribute 'plot_nothing'"):
        report.plot_nothing  # noqa: B018


ASKED = "What may I deploy?"


def test_the_json_has_what_is_expected_of_each_file(zeros):
    plain = zeros.to_dict()
    jsonschema.validate(plain, report.schema())
    assert len(plain["files"]) == len(zeros.model.files) > 3
    assert {name for told in plain["files"] for name in told["files"]} == set(FORMATS)
    for told in plain["files"]:
        shrinkage = 1.0 - (told["rms_after"] / told["rms_before"]) ** 2
        assert told["shrinkage"] == pytest.approx(shrinkage, abs=0.02)
        assert told["rms_after"] > zeros.gap.held_out.rms_after, "lost motion stays"
    left = {told["holds"]: told["rms_after"] for told in plain["files"] if told["min_sigma"] is None}
    assert left["ticks"] > left["zeros"], "an encoder's step is coarser than the zeros are known"


@pytest.mark.slow
def test_the_page_says_what_correct_says_of_the_file(zeros):
    shown = html(zeros)
    assert ASKED in headings(shown)
    told = tables.files(zeros)
    assert told["heads"][1] == "beyond 2 σ (as written)"
    said = expectation(zeros.model.files, "offsets", 2.0)[0]
    cell = next(row for row in told["rows"] if "offsets" in row[0])[1]
    assert f"shrinkage {cell.split(' %')[0]} %" in said
    assert cell in Reader(shown).words


@pytest.mark.slow
def test_what_no_file_holds_is_said_and_has_no_table(demo, written):
    assert "files" not in demo.to_dict()
    assert "holds what is constant; nothing here is" in Reader(html(demo)).words
    assert ASKED not in headings(written(html, "nothing"))
