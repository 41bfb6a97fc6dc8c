"""The text names what the diagnosis says, in order, and nothing that it does not say."""

from dataclasses import replace

from thermal_robot.diagnosis.values import Estimate, Finding, FoldScheme
from thermal_robot.report import text
from thermal_robot.report.words import details


def section(written, heading):
    """Return the lines below a heading."""
    return next(block for block in written.split("\n\n") if block.startswith(heading)).splitlines()[1:]


def test_it_opens_with_the_verdict_and_fits_a_terminal(diagnosis):
    written = text(diagnosis)
    assert " ".join(written.split("\n\n")[0].split()) == " ".join((diagnosis.summary, *details(diagnosis)))
    assert max(len(line) for line in written.splitlines()) <= 96
    assert not written.endswith("\n")
    assert all(line == line.rstrip() for line in written.splitlines())
    assert "\N{NO-BREAK SPACE}" not in written


def test_printing_a_diagnosis_prints_it(diagnosis):
    assert str(diagnosis) == text(diagnosis)


def test_every_candidate_is_told_under_its_status(diagnosis):
    lines = section(text(diagnosis), "WHICH")
    headings = {"found": "  found", "confounded": "  cannot be told apart", "not_found": "  not found"}
    headings |= {"not_testable": "  not testable with these data", "contained": "  part of what was found"}
    for finding in diagnosis.effects:
        heading = max(k for k, line in enumerate(lines) if line == headings[finding.status])
        after = next(k for k in range(heading + 1, len(lines)) if lines[k].split()[0] == finding.name)
        between = [k for k in range(heading + 1, after) if lines[k] in headings.values()]
        assert not between, finding.name


def test_how_far_and_the_noise(case):
    lines = section(text(case("found")), "HOW FAR")
    assert lines[0].split("   ")[0].strip() == "gap, rms distance"
    assert "412 µm → 28 µm" in lines[0]
    assert "415 µm → 30 µm" in lines[1]
    assert "blocked, 5 folds" in lines[1]
    assert lines[2].strip() == "with the 2 rows set aside in it: 452 µm → 182 µm"
    assert "99.5 %   95 % interval 99.0 to 99.7 %" in lines[3]
    assert "26 µm; the instrument's noise as the campaign states it" in lines[4]
    assert "1.09 times that" in " ".join(lines[4:])
    assert "Figures of rows held out have the noise of these rows in them." in " ".join(" ".join(lines[4:]).split())


def test_orientation_is_told_where_it_was_measured(case):
    assert "1.040 mrad → 0.042 mrad" in text(case("confounded"))
    assert "position and orientation measured" in " ".join(text(case("confounded")).split())
    assert "mrad →" not in text(case("found"))


def test_an_effect_that_was_found_is_told_at_length(case):
    which = "\n".join(section(text(case("found")), "WHICH"))
    assert "thermal_elongation     > 99.9 %    96.2 %  (94.1 to 97.4 %)" in which
    assert "where: upper_arm_link 61.0 %, forearm_link 33.0 %, wrist_1_link 2.0 %" in which
    assert "strain per kelvin of upper_arm_link  12.34 ± 0.41 µm/(m·K)" in which
    assert "not determined by these data: strain per kelvin of wrist_2_link" in which
    assert "joint_offset              2.0 %     0.1 %  (−0.4 to 0.6 %)" in which
    assert "geometric               < 0.1 %    −3.1 %  (−6.0 to 0.2 %)" in which


def test_needs_name_a_column_once_for_all_joints(case):
    which = section(text(case("found")), "WHICH")
    assert [line.split(maxsplit=1)[1] for line in which if "needs" in line] == [
        "needs approach.<joint>",
        "needs torque.<joint>, payload or masses in the URDF",
    ]


def test_needs_of_links_are_told_from_those_of_joints(case):
    bending = Finding("thermal_bending", "not_testable", needs=("temperature.hand", "temperature.arm"))
    assert "needs temperature.<link>" in text(replace(case("found"), effects=(bending,), verdict=()))


def test_confounded_effects_name_each_other(case):
    which = "\n".join(section(text(case("confounded")), "WHICH"))
    assert "these data cannot tell it from base_frame" in which
    assert "these data cannot tell it from joint_offset" in which
    assert "zero offset, wrist_1_joint        0.000 ± 0.022 mrad" in which


def test_of_many_parameters_the_most_significant_are_told(case):
    lines = section(text(case("confounded")), "WHICH")
    start = next(k for k, line in enumerate(lines) if "the 6 most significant of 35 parameters" in line)
    shown = lines[start + 1 : start + 7]
    assert shown[0].split("  ")[-1] == "0.420 ± 0.010 mrad"
    assert [float(line.split("  ")[-1].split()[0]) for line in shown] == [0.42, 0.36, 0.35, 0.3, 0.3, 0.28]
    assert lines[start + 7].strip() == "and 29 more, listed in the JSON"


def test_an_undetermined_parameter_is_never_a_number(case):
    wrong = Estimate("strain of nothing", 7.77e-6, 1.11e-6, "1/K", False)
    finding = replace(case("found").effects[0], parameters=(wrong,))
    which = "\n".join(section(text(replace(case("found"), effects=(finding,))), "WHICH"))
    assert "not determined by these data: strain of nothing" in which
    assert "7.7" not in which
    assert "1.11" not in which


def test_where_draws_shares_as_bars(case):
    lines = section(text(case("found")), "WHERE")
    upper, fore = (next(line for line in lines if line.split()[0] == f"{n}_link") for n in ("upper_arm", "forearm"))
    assert upper.endswith("61.0 %")
    assert upper.count("█") == 14
    assert fore.count("█") == 8
    assert "    4 more, at most 0.4 %" in lines
    assert "    none above 0.5 %" in lines  # joints


def test_where_tells_base_tool_and_instrument(case):
    base = case("found")
    told = section(text(replace(base, where=replace(base.where, beyond={"base": 0.18, "tool": 0.03}))), "WHERE")
    at = told.index("  beyond joints and links")
    assert [line.split()[0] for line in told[at + 1 : at + 3]] == ["base", "tool"]
    assert told[at + 1].endswith("18.0 %")
    assert "beyond" not in text(base)


def test_rows_set_aside_are_listed_up_to_ten(case):
    assert "set aside  as outliers: rows 17, 80 of the file (its header is row 1)" in text(case("found"))
    assert "set aside  no row" in text(case("nothing"))
    many = text(replace(case("found"), outliers=tuple(range(2, 18))))
    assert "104 of 120 rows, 16 set aside" in many
    assert "set aside  as outliers: rows 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 6 more" in many


def test_what_the_user_left_out_is_no_absent_effect(case):
    assert "left out   by request (--without joint_gain): joint_gain" in text(
        replace(case("found"), left_out=("joint_gain",))
    )
    assert "left out" not in text(case("found"))


def test_what_plus_minus_means_is_said_once(diagnosis):
    told = text(diagnosis).count("± is one standard deviation")
    assert told == (1 if "±" in text(diagnosis).replace("± is one", "") else 0)


def test_the_hardest_hold_out_is_told_where_it_is_harder(case):
    base = case("found")
    hard = FoldScheme("reach", "the fifth that reaches out furthest", 1, 24, 4.1e-4, 9.15e-5, 0.95, 1e-6)
    told = " ".join(text(replace(base, gap=replace(base.gap, schemes=(hard,), hardest=hard))).split())
    assert "hardest hold-out 410 µm → 92 µm, held out by reach (the fifth that reaches out furthest): 3.0 times" in told
    assert "hardest hold-out" not in text(replace(base, gap=replace(base.gap, schemes=(hard,))))


def test_nothing_found_says_so(case):
    written = text(case("nothing"))
    assert "verdict    no effect; probability of exactly this explanation 93.0 %" in written
    assert "  found: none" in section(written, "WHICH")
    assert section(written, "UNEXPLAINED")[0].strip().startswith("Nothing:")
    assert "NEXT" not in written
    assert "WARNINGS" not in written


def test_what_is_unexplained_is_told_with_reasons_place_and_quantity(case):
    told = " ".join(" ".join(section(text(case("unexplained")), "UNEXPLAINED")).split())
    assert "leave 94.0 µm rms beyond the noise that chance does not explain (p < 1e-12)." in told
    assert "The remainder is 4.1 times the noise floor. It changes with time more than chance allows." in told
    assert "It enters most probably at elbow_joint (72.0 %) or base (20.0 %)." in told
    assert "It follows time (p = 3e-9), elbow_joint (p = 0.004)." in told
    verdict = " ".join(text(case("unexplained")).split("\n\n")[1].split())
    assert "97.8 %; a remainder stays unexplained" in verdict


def test_advice_and_warnings_are_told(case):
    written = text(case("found"))
    assert case("found").advice in written
    assert "to tell apart: thermal_elongation, drift" in written
    assert case("found").warnings[0] in written


def test_zeros_inside_geometry_are_printed_with_what_is_not_seen(case):
    diagnosis = case("contained")
    said = text(diagnosis)
    inside = said[said.index("part of what was found") :]
    for joint in diagnosis.joint_names[1:5]:
        assert f"zero offset, {joint}" in inside
    assert "−7.100 ± 0.020 mrad" in inside
    assert "2 not seen apart from the others or the frames: zero offset, shoulder_pan_joint" in " ".join(inside.split())


def test_criteria_of_the_standard_are_told_of_the_worst(case):
    told = case("repeated")
    lines = section(text(told), "ISO 9283")
    assert [line.split() for line in lines[:4]] == [
        ["pose", "accuracy", "AP", "701", "µm", "→", "62", "µm"],
        ["pose", "repeatability", "RP", "110", "µm"],
        ["path", "accuracy", "AT", "1.50", "mm", "→", "0.25", "mm"],
        ["path", "repeatability", "RT", "200", "µm"],
    ]
    said = " ".join(" ".join(lines[4:]).split())
    assert said.startswith("The worst of 2 poses of 25 to 30 cycles (the standard: 30), and 1 path of 10 cycles")
    assert "After the arrow: corrected, of poses held out." in said
    assert "after registration of base and tool to the same rows." in said
    bare = replace(told.performance, poses=(replace(told.performance.poses[0], corrected=None),), paths=())
    short = section(text(replace(told, performance=replace(bare, registered=()))), "ISO 9283")
    assert len(short) == 3
    assert short[2].strip() == "The worst of 1 pose of 30 cycles (the standard: 30)."
    assert "ISO 9283" not in text(case("found"))
