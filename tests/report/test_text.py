"""The words that text and page share, and the text: it names what a result says, in order, and nothing else."""

import re
from dataclasses import replace

import numpy as np
import pytest
from compared import diagnosed, moved
from report.cases import HARD, JOINTS, case
from report.comparisons import comparison as compared
from report.fleets import EMPTY, SUMMARY

import thermal_robot as tr
from thermal_robot.diagnosis.data_checks import SAID
from thermal_robot.diagnosis.values import Dependence, Estimate, Finding, Location
from thermal_robot.effects.law_words import Size
from thermal_robot.report import calibration_text, comparison_headline, comparison_text, fleet_text, text, words
from thermal_robot.report.text_campaigns import changes, comparison_tables, failures, fleet_headline, fleet_tables
from thermal_robot.report.words import NO_BREAK, STATUS, bound, by_status, displayed_status, facts, needs, sentences


def section(written, heading):
    """Return the lines below a heading."""
    return next(block for block in written.split("\n\n") if block.startswith(heading)).splitlines()[1:]


def flat(lines):
    """Return lines as one, without the spaces that align them."""
    return " ".join((lines if isinstance(lines, str) else " ".join(lines)).split())


def several(count, identified=True):
    """Parameters whose significance grows from the first to the last."""
    return tuple(Estimate(f"p{k}", 1e-5 * (k + 1), 1e-5, "m", identified) for k in range(count))


def said_of(diagnosis=None, **known):
    """Lines before the parameters of an effect, the parameters, and lines after."""
    before, shown, after = words.described(
        Finding(**{"name": "an_effect", "status": "found", **known}), diagnosis or case("found")
    )
    return [line for line, _ in before], shown, [line for line, _ in after]


def test_the_text_opens_with_the_verdict_and_fits_a_terminal(diagnosis):
    written = text(diagnosis)
    assert str(diagnosis) == written
    assert flat(written.split("\n\n")[0]) == " ".join((diagnosis.summary, *words.details(diagnosis)))
    assert max(len(line) for line in written.splitlines()) <= 96
    assert not written.endswith("\n")
    assert all(line == line.rstrip() for line in written.splitlines())
    assert NO_BREAK not in written
    told = written.count("± is one standard deviation")
    assert told == (1 if "±" in written.replace("± is one", "") else 0)


def test_every_candidate_is_told_under_its_status(diagnosis):
    lines = section(text(diagnosis), "WHICH")
    headings = {status: f"  {heading}" for status, heading in STATUS.items()}
    for finding in diagnosis.effects:
        heading = max(k for k, line in enumerate(lines) if line == headings[finding.status])
        after = next(k for k in range(heading + 1, len(lines)) if lines[k].split()[0] == finding.name)
        assert not [k for k in range(heading + 1, after) if lines[k] in headings.values()], finding.name


def test_what_is_not_found_and_yet_probable_is_in_question_and_shown_between():
    doubtful = Finding("joint_gain", "not_found", 0.7)
    for finding, told in (
        (doubtful, "in_question"),
        (replace(doubtful, probability=0.3), "not_found"),
        (replace(doubtful, probability=None), "not_found"),
        (replace(doubtful, status="confounded"), "confounded"),
    ):
        assert displayed_status(finding) == told
    base = case("confounded")
    shown = by_status(replace(base, effects=(*base.effects[::-1], doubtful)))
    assert sorted(f.name for f in shown) == sorted(f.name for f in (*base.effects, doubtful))
    assert {f.status for f in shown[: shown.index(doubtful)]} == {"found", "confounded"}
    assert {f.status for f in shown[shown.index(doubtful) + 1 :]} == {"not_found", "not_testable"}
    rival = replace(doubtful, confounded_with=("drift",))
    told = flat(text(replace(base, effects=(*base.effects, rival))))
    assert "in question joint_gain 70.0 %" in told
    assert "cannot be told apart from drift" in told


def test_how_far_and_the_noise():
    lines = section(text(case("found")), "HOW FAR")
    for line, parts in enumerate(
        (
            ("gap, rms distance", "412 µm → 28 µm", "118 of 120 rows, 2 set aside"),
            ("415 µm → 30 µm", "blocked, 5 folds"),
            ("with the 2 rows set aside in it: 452 µm → 182 µm",),
            ("99.5 %   95 % interval 99.0 to 99.7 %",),
            ("26 µm; the instrument's noise as the campaign states it",),
        )
    ):
        assert all(part in lines[line] for part in parts)
    assert "1.09 times that" in flat(lines[4:])
    assert "Figures of rows held out have the noise of these rows in them." in flat(lines[4:])
    assert "with the row set aside in it: " in text(case("found", outliers=(17,)))
    for alone in (case("found", outliers=()), case("found", gap={"held_out": {"rms_before_with_aside": None}})):
        assert "aside in it" not in text(alone)
    hard = flat(text(case("found", gap={"hardest": HARD})))
    assert "hardest hold-out 410 µm → 92 µm, held out by temperature (the warmest fifth): 3.0 times the average" in hard
    assert "hardest hold-out" not in text(case("found", gap={"schemes": (HARD,)}))
    turned = flat(text(case("confounded")))
    assert "1.040 mrad → 0.042 mrad" in turned
    assert "position and orientation measured" in turned
    assert "mrad →" not in text(case("found"))


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("stated", "as the campaign states it"),
        ("repeats", "differences between repeated commands"),
        ("scatter", "the instrument's noise and the scatter of the joints"),
        ("remainder", "an upper bound, from the remainder itself"),
    ],
)
def test_the_noise_says_where_it_is_known_from(source, said):
    assert said in words.noise(case("found", gap={"noise_source": source}))
    assert "times" not in words.noise(case("found", gap={"noise_floor": 0.0}))


def test_effects_are_told_at_length_or_in_short():
    which = section(text(case("found")), "WHICH")
    told = "\n".join(which)
    for said in (
        "thermal_elongation     > 99.9 %    96.2 %  (94.1 to 97.4 %)",
        "where: upper_arm_link 61.0 %, forearm_link 33.0 %, wrist_1_link 2.0 %",
        "strain per kelvin of upper_arm_link  12.34 ± 0.41 µm/(m·K)",
        "not determined by these data: strain per kelvin of wrist_2_link",
        "joint_offset              2.0 %     0.1 %  (−0.4 to 0.6 %)",
        "geometric               < 0.1 %    −3.1 %  (−6.0 to 0.2 %)",
    ):
        assert said in told
    assert [line.split(maxsplit=1)[1] for line in which if "needs" in line] == [
        "needs approach.<joint>",
        "needs torque.<joint>, payload or masses in the URDF",
    ]
    which = section(text(case("confounded")), "WHICH")
    assert "zero offset, wrist_1_joint        0.000 ± 0.022 mrad" in "\n".join(which)
    start = next(k for k, line in enumerate(which) if "the 6 most significant of 35 parameters" in line)
    assert which[start + 1].endswith("0.420 ± 0.010 mrad")
    assert which[start + 7].strip() == "and 29 more, listed in the JSON"
    inside = text(case("contained")).partition("part of what was found")[2]
    assert all(f"zero offset, {joint}" in inside for joint in JOINTS[1:5])
    assert "−7.100 ± 0.020 mrad" in inside
    assert "2 not seen apart from the others or the frames: zero offset, shoulder_pan_joint" in flat(inside)


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (("time",), "time"),
        (("approach.joint_1", "approach.joint_2"), "approach.<joint>"),
        (("temperature.arm", "temperature.hand"), "temperature.<link>"),
        (("velocity.joint_2",), "velocity.joint_2"),
        (("torque.<joint>", "payload", "masses in the URDF"), "torque.<joint>, payload or masses in the URDF"),
    ],
)
def test_needs_name_a_column_once(wanted, said):
    assert needs(Finding("an_effect", "not_testable", needs=wanted), ("joint_1", "joint_2")) == said


def test_few_parameters_keep_the_order_of_the_chain_and_of_many_the_most_significant_come_first():
    before, shown, after = said_of(parameters=several(7))
    assert ([name for name, _ in shown], before, after) == ([f"p{k}" for k in range(7)], [], [])
    before, shown, after = said_of(parameters=several(20))
    assert [name for name, _ in shown] == ["p19", "p18", "p17", "p16", "p15", "p14"]
    assert before == ["the 6 most significant of 20 parameters:"]
    assert after == ["and 14 more, listed in the JSON"]
    _, shown, after = said_of(parameters=(*several(2), *several(6, identified=False)))
    assert (len(shown), after) == (2, ["not determined by these data: p0; p1; p2; p3 and 2 more"])
    whole = case("contained")
    _, _, after = said_of(whole, parameters=several(2), unseen=whole.effects[0].unseen)
    assert after[0].startswith("3 not seen apart from the others or the frames: shift d of shoulder_pan_joint; ")


def test_laws_and_what_an_effect_does_in_each_joint_are_told_before_the_parameters():
    sizes = tuple(Size("peak to peak", k * 1e-4, 1e-5, "rad", f"j{k}") for k in (6, 5, 4, 3, 2))
    waves = {"parameters": several(2, identified=False), "size": sizes}
    told = ", ".join(f"j{k} 0.{k}00 ± 0.010 mrad" for k in (6, 5, 4, 3))
    assert said_of(**waves) == ([f"peak to peak: {told} and 1 more"], [], [])
    assert said_of(quantity="time")[0] == ["a law found in the data: it follows time"]
    known = {"parameters": several(1, identified=False), "quantity": "time", "size": (Size("step", 1e-4, 1e-6, "rad"),)}
    assert said_of(**known)[2] == []
    base = case("law")
    law = base.finding("discovered.1")
    before, *_ = words.described(law, base)
    assert before[0][0] == (
        "a law found in the data: an error at elbow_joint that follows time (step); step 0.1700 ± 0.0060 mrad; usually "
        "warming, or something that slips"
    )
    both = (Size("difference", 4.2e-4, 3e-5, "m"), Size("difference", 3e-4, 5e-5, "rad"))
    before, *_ = words.described(replace(law, size=both), base)
    assert "; difference 420 ± 30 µm and 0.300 ± 0.050 mrad; usually" in before[0][0]
    assert [f.name for f in words.laws(base)] == ["discovered.1"]
    alike = replace(base.effects[0], name="discovered.thermal")
    renamed = replace(base, effects=(alike, replace(law, name="own")), verdict=("discovered.thermal", "own"))
    assert [f.name for f in words.laws(renamed)] == ["own"]
    assert list(sentences(renamed))[-1] == (
        "own describes part of it: an error at elbow_joint that follows time (step)."
    )


def test_rivals_are_named_with_the_way_to_see_them():
    base, said = case("confounded"), "these data cannot tell it from drift"
    own = {"status": "confounded", "confounded_with": ("drift",)}
    see = "--without joint_offset shows what would then stand in its place"
    assert said_of(base, **own | {"name": "joint_offset"})[0] == [f"{said}; {see}"]
    assert said_of(base, **own)[0] == [said]
    assert said_of(base, **own | {"status": "contained"})[0] == ["its part of drift"]
    frame = Finding("base_frame", "not_testable", needs=('frames.base = "known"',))
    told = said_of(
        replace(base, effects=(*base.effects[:2], frame)), name="joint_offset", confounded_with=("base_frame",)
    )
    assert told[0] == ["these data cannot tell it from base_frame"]


def test_places_are_told_largest_first_and_small_ones_counted():
    where = tuple(Location("joint", f"j{k}", share) for k, share in enumerate((0.5, 0.2, 0.1, 0.05, 0.04, 0.001)))
    four = "where: joint j0 50.0 %, joint j1 20.0 %, joint j2 10.0 %, joint j3 5.0 %"
    assert said_of(locations=where)[0] == [f"{four} and 2 more, at most 4.0 %"]
    assert said_of(locations=where[5:])[0] == ["where: joint j5 0.1 %"]
    none = (*where[:4], Location("joint", "j6", 0.0))
    assert said_of(locations=none)[0] == [f"{four} and 1 more, less than 0.1 %"]


@pytest.mark.parametrize(
    "said",
    ["412 µm", "96.0 %", "1.04 ± 0.02 mrad", "24 s", "χ² 5.4", "p = 0.01", "p < 1e-12", "> 99.9 %", "2 mm", "3 m"],
)
def test_a_number_stays_with_its_unit(said):
    assert bound(f"it is {said}, so") == f"it is {said.replace(' ', NO_BREAK)}, so"
    assert bound("5 more of them, 3 mice") == "5 more of them, 3 mice"


def test_facts_are_verdict_campaign_rows_and_effects_left_out():
    told = facts(case("found"))
    assert told == {
        "Verdict": "thermal_elongation; probability of exactly this explanation 97.8 %",
        "Campaign": "hall_3_morning: robot ur10, tool frame tool0, 120 rows, position measured",
        "Set aside": "as outliers: rows 17, 80 (lines of the file; of a data frame, its index)",
        "Rows used": "118 of 120 rows, 2 set aside",
    }
    nothing = facts(case("nothing"))
    assert nothing["Verdict"].startswith("no effect; ")
    assert (nothing["Set aside"], nothing["Rows used"]) == ("no row", "all 120 rows")
    assert facts(case("unexplained"))["Verdict"].endswith("; a remainder stays unexplained")
    single = facts(case("confounded", samples=1, campaign=""))["Campaign"]
    assert single == "robot ur10, tool frame tool0, 1 row, position and orientation measured"
    assert ": row 17 (" in facts(case("found", outliers=(17,)))["Set aside"]
    many = text(case("found", outliers=tuple(range(2, 18))))
    assert "104 of 120 rows, 16 set aside" in many
    assert "set aside  as outliers: rows 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 6 more" in many
    assert "about      robot serial 2018" in text(case("found", about={"robot_serial": "2018"}))
    out = case("found", left_out=("drift", "geometric"))
    assert facts(out)["Left out"] == "by request (--without drift geometric): drift, geometric"
    few = replace(out, effects=out.effects[:1])
    assert facts(few)["Left out"] == "by request all but thermal_elongation (--only thermal_elongation)"
    assert "left out   by request (--without joint_gain)" in text(case("found", left_out=("joint_gain",)))


def test_that_a_quantity_is_read_with_the_other_sign_comes_before_all_else():
    told = case("found", warnings=("column 'a' is empty", *SAID.values()))
    assert words.turned(told) == [f"Note: {said}." for said in SAID.values()]
    assert text(replace(told, warnings=(SAID["torque"],))).startswith(f"Note: {SAID['torque']}.\n{told.summary[:40]}")
    assert words.turned(case("found")) == []


def test_what_is_left_is_told_in_whole_sentences():
    assert list(sentences(case("found"))) == [
        "Nothing: what remains is no larger and no more structured than the noise (p = 0.43)."
    ]
    said = list(sentences(case("found", gap={"noise_source": "remainder"})))
    assert said[0] == "No pattern was found in what remains (p = 0.43)."
    assert "cannot be told" in said[1]
    assert flat(section(text(case("unexplained")), "UNEXPLAINED")) == (
        "The known effects leave 94.0 µm rms beyond the noise that chance does not explain (p < 1e-12). The remainder "
        "is 4.1 times the noise floor. It changes with time more than chance allows. It enters most probably at "
        "elbow_joint (72.0 %) or base (20.0 %). It follows time (p = 3e-9), elbow_joint (p = 0.004)."
    )
    said = " ".join(sentences(case("law")))
    assert "It follows" not in said
    assert "discovered.1 describes part of it: an error at elbow_joint" in said
    own, sizeless = (
        case("unexplained", gap={"noise_source": "remainder"}),
        case("unexplained", unexplained={"rms": 0.0}),
    )
    assert next(sentences(own)).startswith("The known effects leave 94.0 µm rms that chance")
    assert next(sentences(sizeless)).startswith("The known effects leave a remainder that chance")
    spots = tuple(Location("joint", f"j{k}", share) for k, share in enumerate((0.4, 0.3, 0.2, 0.09, 0.01)))
    follows = tuple(Dependence(f"q{k}", p) for k, p in enumerate(np.geomspace(1e-9, 1e-3, 5)))
    said = list(sentences(case("unexplained", unexplained={"locations": spots, "depends_on": follows})))
    assert "It enters most probably at joint j0 (40.0 %), joint j1 (30.0 %) or joint j2 (20.0 %)." in said
    assert "q2" in said[-1]
    assert "q3" not in said[-1]


def test_where_draws_shares_as_bars():
    base = case("found")
    lines = section(text(base), "WHERE")
    upper, fore = (next(line for line in lines if line.split()[0] == f"{n}_link") for n in ("upper_arm", "forearm"))
    assert upper.endswith("61.0 %")
    assert (upper.count("█"), fore.count("█")) == (14, 8)
    assert "    4 more, at most 0.4 %" in lines
    assert "    none above 0.5 %" in lines  # joints
    assert "beyond" not in text(base)
    told = section(text(case("found", where={"beyond": {"base": 0.18, "tool": 0.03}})), "WHERE")
    at = told.index("  beyond joints and links")
    assert [line.split()[0] for line in told[at + 1 : at + 3]] == ["base", "tool"]
    assert told[at + 1].endswith("18.0 %")


def test_sections_without_content_are_left_out():
    written = text(case("nothing"))
    assert "verdict    no effect; probability of exactly this explanation 93.0 %" in written
    assert "  found: none" in section(written, "WHICH")
    assert "NEXT" not in written
    assert "WARNINGS" not in written
    found = text(case("found"))
    assert case("found").advice in found
    assert "to tell apart: thermal_elongation, drift" in found
    assert case("found").warnings[0] in found


def test_criteria_of_the_standard_are_told_of_the_worst():
    told = case("repeated")
    lines = section(text(told), "ISO 9283")
    assert [flat(line) for line in lines[:4]] == [
        "pose accuracy AP 701 µm → 62 µm",
        "pose repeatability RP 110 µm",
        "path accuracy AT 1.50 mm → 0.25 mm",
        "path repeatability RT 200 µm",
    ]
    said = flat(lines[4:])
    assert said.startswith("The worst of 2 poses of 25 to 30 cycles (the standard: 30), and 1 path of 10 cycles")
    assert "After the arrow: corrected, of poses held out." in said
    assert "after registration of base and tool to the same rows." in said
    pose = replace(told.performance.poses[0], corrected=None)
    short = section(text(case("repeated", performance={"poses": (pose,), "paths": (), "registered": ()})), "ISO 9283")
    assert len(short) == 3
    assert short[2].strip() == "The worst of 1 pose of 30 cycles (the standard: 30)."
    assert "ISO 9283" not in text(case("found"))


def test_a_calibration_is_told_with_its_deviations_and_what_it_does_not_tell():
    off = {"joint_offset": {"joint_2": 1e-3, "joint_3": -7e-4}}

    def calibrated(effects=off, *only, **further):
        frames = {"base": np.eye(4), "tool_frame": "tool0"}
        run = tr.simulate("builtin:rv_m2", effects, rows=60, noise=3e-5, seed=6, **frames, **further)
        return tr.calibrate(run, *only)

    found = calibrated()
    said = calibration_text(found)
    assert str(found) == said
    for part in (
        "60 samples of position, 0 set aside. Fitted as asked, not chosen",
        "joint zero offsets (joint_offset, a part of geometric), ± one standard deviation",
        "not seen apart from the others or the frames: zero offset, joint_1",
        "gap, rms",
    ):
        assert part in said
    assert "turn, rms" not in said
    assert "not noise" not in said
    assert max(map(len, said.splitlines())) <= 96
    assert "turn, rms" in str(calibrated(measures="pose", noise_orientation=1e-4))
    worn = calibrated({**off, "backlash": {"joint_3": 8e-4}}, "joint_offset")
    assert "What is left is not noise: something else is at work" in str(worn)


def change(**more):
    plain = {"title": "joint zero offsets", "effect": "own", "kind": "joint", "place": "elbow", "since": "may"}
    plain |= {"groups": [["april"], ["may"]], "values": [1e-3, 1.25e-3], "unit": "rad", "parameters": ["zero"]}
    return plain | {"chi2": 31.4, "degrees": 1, "p_value": 2e-7} | more


def comparison(changes=(), statuses=("shared",), lost=None):
    effects = [{"name": s, "title": f"what is {s}", "status": s} for s in statuses]
    lost = [s for s in statuses if s in ("contradicts", "not_needed")] if lost is None else lost
    campaigns = [{"name": "april"}, {"name": "may"}]
    return {"changes": list(changes), "effects": effects, "campaigns": campaigns, "verdict": {"lost": lost}}


def test_the_headline_of_a_comparison_says_what_changed_and_which_names_are_lost():
    said = comparison_headline
    assert said(comparison()) == "Nothing changed between april and may. They share what is shared."
    told = said(comparison([change()], ("shared", "contradicts")))
    assert told.startswith("Joint zero offsets at elbow changed since may.")
    assert told.endswith("What is contradicts loses its name.")
    both = comparison([], ("contradicts", "not_needed"))
    assert said(both) == "What is contradicts and what is not_needed lose their name."
    nameless = comparison([change(effect="contradicts")], ("contradicts",), lost=[])
    assert said(nameless) == "What differs between april and may has no name."
    assert "and 2 more." in said(comparison([change()] * 5))


def test_changes_effects_and_parameters_are_told_with_their_chance():
    (said,) = changes(comparison([change()]))
    assert "since may: 1.00 mrad in april, 1.25 mrad in may; χ² 31.4 on 1, below 0.001 % by chance" in said
    apart = change(since="", groups=[["a", "c"], ["b"]], values=[], parameters=["x", "y"])
    assert "between a with c and b (2 parameters)" in changes(comparison([apart]))[0]
    for p, chance in ((None, "–"), (1e-9, "below 0.001 %"), (0.0213, "2.1 %"), (1.0, "100 %")):
        assert f"χ² 31.4 on 1, {chance} by chance" in changes(comparison([change(p_value=p)]))[0]
    row = {"name": "own", "status": "contradicts", "reason": "april alone needs it", "degrees": 0, "p_value": 1.0}
    each = {
        "name": "zero",
        "unit": "rad",
        "values": [-1.165e-3, None],
        "stds": [3.8e-5, None],
        "between": ["april", "may"],
    }
    silent = {**each, "values": [None, None]}
    told = {"parameters": [{**each, "difference": None, "std": None, "p_value": None}, silent]}
    absent = {"name": "other", "status": "absent", "parameters": []}
    failed = {"campaigns": ["april", "may"], "note": "no pose in both"}
    for named, status in ((["april"], "loses its name"), ([], "not at work")):
        effects = [{**row, "named": named, **told}, absent]
        shown = comparison_tables({**comparison(), "effects": effects, "predicted": [failed]})
        assert shown["effects"][1:] == [("own", f"{status}: april alone needs it", "–", "–")]
        assert shown["parameters"][1:] == [("own", "zero", "−1.165 ± 0.038 mrad", "–", "–", "–")]
        assert shown["predictions"][1:] == [("april and may", "no pose in both", "–", "–", "–")]


def test_the_text_of_a_comparison_tells_all_parts():
    plain = tr.compare(diagnosed(1), diagnosed(3, moved(4e-4)), names=["before", "after"]).to_dict()
    said = comparison_text(plain)
    assert said.splitlines()[0] == comparison_headline(plain)
    headings = ("CHANGED", "EFFECTS", "PARAMETERS", "PREDICTIONS", "NOT COMPARED")
    for part in (*headings, "zero offset, joint_3", "before and after"):
        assert part in said
    assert not re.search(r"\d\n *(%|µm|mrad)", comparison_text(compared(8)))
    quiet = comparison_text({**plain, "changes": [], "not_told": []})
    assert "  nothing\n" in quiet
    assert "NOT COMPARED" not in quiet


def test_the_tables_of_a_fleet_say_what_its_summary_holds():
    tables = fleet_tables(SUMMARY)
    assert all(len({len(line) for line in table}) == 1 for table in tables.values())
    frequent, gathered, shared, differs, apart, cases = (table[1:] for table in tables.values())
    places = "joint_0 2, joint_1 2, joint_2 2, joint_3 2, …"
    assert frequent == [("joint offset", "12 of 28, in 2 or another", places)]  # drift was never found
    assert gathered == [("joint offset", "hall 2", "9 of 10", "3 of 18", "0.002 %")]
    mean, spread = "12.00 ± 0.40 µm/(m·K)", "1.10 ± 0.30 µm/(m·K)"
    assert shared == [("thermal elongation", "strain of fore_arm", mean, spread, "28", "below 0.001 %")]
    assert differs == [
        ("joint offset", "zero offset, joint_2", "hall 2", "0.4100 ± 0.0050 mrad", "10", "below 0.001 %"),
        ("", "", "hall 1", "−2.0 ± 4.0 µrad", "18", ""),
    ]
    assert apart == [("arm_07", "backlash", "lost motion, joint_4", "0.500 ± 0.010 mrad", "1.00 µrad", "> 99.9 %")]
    assert cases[0] == ("arm_00", "hall/arm_00", "joint offset", "joint_2", "97.0 %", "200 µm", "30.0 µm")
    assert cases[1][2] == "joint offset (or base frame)"
    nothing = {**SUMMARY["found"][0], "effect": "", "place": "", "probability": None}
    (line,) = fleet_tables({**EMPTY, "found": [nothing]})["What is wrong with which robot, largest gaps first"][1:]
    assert line[2:5] == ("no effect explains it", "", "–")
    assert failures(SUMMARY) == ["hall_1/arm_05 (failed): measurements.csv, row 3: <nonsense>"]
    assert fleet_headline({**SUMMARY, "campaigns": 1, "robots": 1}).startswith("1 campaign of 1 robot:")


def test_the_text_of_a_fleet_tells_every_part_and_cuts_long_ones():
    said = fleet_text(SUMMARY)
    lines = said.splitlines()
    assert lines[0] == fleet_headline(SUMMARY) == "30 campaigns of 29 robots: 28 diagnosed, 1 failed, 1 unusable."
    for part in ("12 of 28", "hall 2", "fore_arm", "arm_07", "hall_1/arm_05 (failed)", "arm_11", "… and 8 more"):
        assert part in said
    assert "arm_12 " not in said
    assert all(line == line.rstrip() for line in lines)
    at = lines.index("Robots that stand out")
    assert lines[at + 1].index("parameter") == lines[at + 2].index("lost motion")
    assert fleet_text({**EMPTY, "failures": []}) == "30 campaigns of 29 robots: 30 failed."
    assert "… and 2 more; the page" in fleet_text({**EMPTY, "failures": SUMMARY["failures"] * 14})
