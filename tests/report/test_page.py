"""The page says the same as the text, stands alone, and trusts no name."""

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser

import pytest

from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.values import (
    DataFault,
    Dependence,
    Estimate,
    Finding,
    FoldScheme,
    Location,
    Misfit,
    Unexplained,
    Where,
)
from thermal_robot.report import advice, fragment, headline, html, html_parts

KINDS = ("found", "nothing", "unexplained", "confounded")
EMPTY = {"meta", "link", "br", "img", "input", "hr"}
UGLY = "$a_1$ <script>alert('x')</script> & \"quote\" \\frac"


class Reader(HTMLParser):
    """Collects text, tags, references and identifiers, and checks that every tag is closed."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.text, self.references, self.ids = [], [], [], [], []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag not in EMPTY:
            self.open.append(tag)
        for name, value in attrs:
            if name in ("href", "src", "xlink:href", "srcset", "action", "data"):
                self.references.append(value)
            self.references += re.findall(r"url\(([^)]*)\)", value or "")
            if name == "id":
                self.ids.append(value)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in EMPTY:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] != "style":
            self.text.append(data)

    @property
    def words(self):
        return re.sub(r"\s+", " ", " ".join(self.text))


@pytest.fixture(params=[html, fragment])
def write(request):
    return request.param


@pytest.fixture
def no_drawing(monkeypatch):
    """Leave the figures out, where a test is about the words."""
    monkeypatch.setattr(html_parts, "_svg", lambda drawn, label: "<svg></svg>")


def ugly(base):
    """Put a name that is no name wherever a name can stand."""
    parameters = (Estimate(UGLY, 1.0, 0.1, UGLY, True), Estimate(UGLY, None, None, UGLY, False))
    effects = (
        replace(base.effects[0], name=UGLY, locations=(Location("link", UGLY, 0.4),), parameters=parameters),
        Finding(UGLY + "2", "not_testable", needs=(UGLY,)),
        Finding(UGLY + "3", "confounded", 0.5, None, None, confounded_with=(UGLY,)),
    )
    reasons = Unexplained(True, 1e-5, 0.001, (UGLY,), (Location("joint", UGLY, 0.9),), (Dependence(UGLY, 0.001),))
    return replace(
        base,
        **dict.fromkeys(("campaign", "robot", "tool_frame", "summary", "advice"), UGLY),
        joint_names=(UGLY, *base.joint_names[1:]),
        separates=((UGLY, "drift"),),
        warnings=(UGLY,),
        verdict=(UGLY,),
        gap=replace(base.gap, noise_source=UGLY, held_out=replace(base.gap.held_out, scheme=UGLY)),
        effects=effects,
        where=Where({"x": 1.0, "y": 0.0, "z": 0.0}, {UGLY: 0.4}, {UGLY: 0.3}, {UGLY: 0.2}),
        unexplained=reasons,
        rows=replace(base.rows, covariates={UGLY: base.rows.covariates["time"]}),
    )


@pytest.mark.parametrize("kind", KINDS)
def test_it_needs_nothing_from_outside(write, written, kind):
    page = written(write, kind)
    assert "//" not in re.sub(r"data:image/png;base64,[\w+/=\s]*", "", page)
    assert "@import" not in page
    references = Reader(page).references
    assert references
    assert all(r.startswith(("#", "data:image/png;base64,")) for r in references)


@pytest.mark.parametrize("kind", KINDS)
def test_references_within_figures_find_their_own_target(write, written, kind):
    reader = Reader(written(write, kind))
    assert len(reader.ids) == len(set(reader.ids))
    assert {r[1:] for r in reader.references if r.startswith("#")} <= set(reader.ids)


def test_every_name_is_escaped(write, case):
    page = write(ugly(case("unexplained")))
    assert "<script" not in page
    assert "script" not in Reader(page).tags
    assert page.count("&lt;script&gt;") > 5
    assert UGLY in re.sub(r"\s+", " ", unescape(page))


@pytest.mark.usefixtures("no_drawing")
def test_equal_diagnoses_give_equal_pages(case):
    assert html(case("found")) == html(case("found"))


def test_it_says_what_the_diagnosis_says(write, written, case):
    words = Reader(written(write, "found")).words
    for said in (
        case("found").summary,
        "412 µm",
        "28 µm",
        "99.5 %",
        "95 % interval",
        "99.0 to 99.7 %",
        "12.34 ± 0.41 µm/(m·K)",
        "96.2 % (94.1 to 97.4 %)",
        "not determined by these data: strain per kelvin of wrist_2_link",
        "needs approach.<joint>",
        case("found").warnings[0],
    ):
        assert said in words, said


@pytest.mark.usefixtures("no_drawing")
def test_an_undetermined_parameter_is_never_a_number(write, case):
    wrong = Estimate("strain of nothing", 7.777e-6, 1.111e-6, "1/K", False)
    finding = replace(case("found").effects[0], parameters=(wrong,))
    words = Reader(write(replace(case("found"), effects=(finding,)))).words
    assert "not determined by these data: strain of nothing" in words
    assert not re.search(r"7\.7[78]|1\.1[12]", words)


def test_the_unexplained_is_flagged(write, written):
    page = written(write, "unexplained")
    assert 'class="tr-flag"' in page
    assert "It enters most probably at elbow_joint (72.0 %)" in Reader(page).words
    assert 'class="tr-flag"' not in written(write, "found")


def test_the_page_is_a_document_with_every_section(written):
    page = written(html, "found")
    assert page.startswith("<!DOCTYPE html>")
    assert "<title>Diagnosis of hall_3_morning</title>" in page
    headings = re.findall(r"<h2>(.*?)</h2>", page)
    assert headings == ["How far", "Which", "Where", "Unexplained", "Next", "Set aside", "Warnings"]
    assert page.count("<svg") == 5
    assert "prefers-color-scheme: dark" in page
    assert "size: A4" in page


def test_sections_without_content_are_left_out(written):
    headings = re.findall(r"<h2>(.*?)</h2>", written(html, "nothing"))
    assert headings == ["How far", "Which", "Where", "Unexplained"]


@pytest.mark.usefixtures("no_drawing")
def test_the_date_is_that_which_was_given(case):
    assert "1 April 2031 &lt;&gt;</footer>" in html(case("found"), generated="1 April 2031 <>")
    assert re.search(r"<footer>thermal-robot( [\w.+]+)?(, (pin|numpy|scipy) [\w.+]+)+</footer>", html(case("found")))


def test_a_notebook_shows_the_fragment(case, written):
    shown = case("found")._repr_html_()
    assert shown == written(fragment, "found")  # drawn anew: equal diagnoses give equal pieces
    assert shown.startswith('<div class="thermal-robot">')
    assert "<html" not in shown
    rules = re.search(r"<style>(.*?)</style>", shown, re.DOTALL)[1]
    selectors = [found.strip() for found in re.findall(r"([^{}]+)\{", rules)]
    assert all(".thermal-robot" in selector for selector in selectors if not selector.startswith("@media"))


def test_figures_take_the_colours_of_the_page(written):
    page = written(html, "found")
    assert "var(--tr-ink,#22282e)" in page
    assert "var(--tr-before,#e69f00)" in page


def test_a_long_campaign_stays_small(case, make_rows):
    long = replace(case("unexplained"), samples=12000, rows=make_rows(12000))
    assert len(html(long)) < 2_000_000


@pytest.mark.usefixtures("no_drawing")
def test_the_hardest_way_of_holding_out_is_told(case):
    base = case("found")
    worst = FoldScheme("temperature", "the warmest fifth", 2, 40, 4.1e-4, 9.15e-5, 0.95, 1e-6)
    words = Reader(html(replace(base, gap=replace(base.gap, schemes=(worst,), hardest=worst)))).words
    assert "Rows held out in the hardest way: 410 µm → 92 µm, held out by temperature (the warmest fifth)" in words
    assert "held out by temperature" not in Reader(html(replace(base, gap=replace(base.gap, schemes=(worst,))))).words


@pytest.mark.usefixtures("no_drawing")
def test_the_page_says_what_the_text_says(case, law_case):
    page = Reader(html(replace(law_case(), left_out=("drift",)))).words
    for said in (
        "as outliers: rows 17, 80 of the file (its header is row 1)",
        "118 of 120 rows, 2 set aside",
        "by request (--without drift)",
        "± is one standard",
    ):
        assert said in page
    assert "None of the effects that were considered has the shape of the law" in page


@pytest.mark.usefixtures("no_drawing")
def test_the_gap_with_rows_set_aside_is_told_where_there_are_any(case):
    def page(kind):
        return unescape(re.sub(r"<[^>]+>", "", html(case(kind))))

    assert "The gap on rows held out with the 2 rows set aside in it: 452 µm → 182 µm." in page("found")
    assert "set aside in it" not in page("nothing")
    assert "Figures of rows held out have the noise of these rows in them." in page("nothing")


@pytest.mark.usefixtures("no_drawing")
def test_a_law_is_drawn_where_its_fit_is_at_hand(law_case, monkeypatch):
    drawn = []
    monkeypatch.setattr(Diagnosis, "explain", lambda self, name: drawn.append(name))
    for part in ("model_section", "arm_figure"):  # they want a whole fit
        monkeypatch.setattr(f"thermal_robot.report.page.{part}", lambda _: "")
    page = html(replace(law_case(), fit=object()))
    assert drawn == ["discovered.1"]
    assert page.count("<svg") == 6
    assert html(law_case()).count("<svg") == 5
    assert "follows time (step); step 0.1700 ± 0.0060 mrad; usually warming" in Reader(page).words


@pytest.mark.usefixtures("no_drawing")
def test_the_next_step_is_told_with_what_it_would_separate(case):
    words = Reader(html(case("found"))).words
    assert f"{case('found').advice} to tell apart: thermal_elongation, drift" in words


@pytest.fixture
def misfit(case):
    """Positions in mm that were declared as m, in two rows."""
    base = replace(case("unexplained"), warnings=("the target lies 62.6 m away",))
    fault = DataFault(("metric unit",), "positions stand in mm, not in m", "correct length_unit", 413.0, 8e-5, (3, 7))
    base = replace(base, misfit=Misfit(fault))
    return replace(base, summary=headline(base), advice=advice(base))


def test_of_a_table_at_fault_nothing_is_said_of_the_robot(misfit, case, write):
    page = write(misfit)
    words = Reader(page).words
    for said in (misfit.summary, misfit.advice, "robot and table do not belong together", "rows 3, 7", "62.6 m away"):
        assert said in words
    assert words.count(misfit.advice) == 1
    assert "<svg" not in page
    assert "<table" not in page
    sound = Reader(write(case("unexplained"))).words
    for told in ("Gap before", "412 µm", "thermal_elongation", "elbow_joint", "nexplained"):
        assert told in sound
        assert told not in words


def test_the_page_of_a_table_at_fault_ends_with_its_files(misfit):
    page = html(misfit, files={"campaign.toml": "0123abcd"})
    assert re.findall(r"<h2>(.*?)</h2>", page) == ["Next", "Warnings"]
    assert "0123abcd</code></li></ul>" in page
    assert "script-src 'none'" in page
