"""What the headline has no room for is said below it, and only then."""

from dataclasses import replace

import pytest

from thermal_robot.diagnosis.values import Finding, FoldScheme, Misfit
from thermal_robot.report.words import details


def test_a_plain_diagnosis_needs_no_details(case):
    assert list(details(case("found"))) == []
    assert list(details(case("nothing"))) == []


def test_smaller_causes_are_named(case):
    base = case("found")
    causes = tuple(replace(base.effects[0], name=f"cause_{k}", shrinkage=0.4 / (k + 1)) for k in range(5))
    said = list(details(replace(base, effects=causes, verdict=tuple(f.name for f in causes))))
    assert said == ["The smaller ones are cause 3 and cause 4."]
    said = list(details(replace(base, effects=causes[:4], verdict=tuple(f.name for f in causes[:4]))))
    assert said == ["The smaller one is cause 3."]


def test_what_cannot_be_told_apart_is_named(case):
    assert list(details(case("confounded"))) == ["Joint offset cannot be told apart from base frame."]


def test_scatter_beside_a_cause_is_named(case):
    base = case("found")
    random = Finding("scatter", "found", 0.99, 0.0, title="joints that scatter", random=True)
    both = replace(base, effects=(base.effects[0], random), verdict=("thermal_elongation", "scatter"))
    assert list(details(both)) == ["There is also scatter, which no correction removes: joints that scatter."]
    assert list(details(replace(both, effects=(random,), verdict=("scatter",)))) == []


def test_a_law_is_no_known_effect(law_case):
    assert list(details(law_case())) == ["No known effect has the shape of the law that was found."]
    narrowed = replace(law_case(), left_out=("drift",))
    assert next(iter(details(narrowed))).startswith("None of the effects that were considered has the shape")
    assert list(details(replace(law_case(), verdict=("thermal_elongation",)))) == []


@pytest.mark.parametrize("shrinkage", [0.4, -0.6])
def test_where_a_correction_harms_it_says_so(case, shrinkage):
    base = case("found")
    scheme = FoldScheme("temperature", "the warmest fifth", 2, 40, 4.1e-4, 5.2e-4, shrinkage, 1e-6)
    said = list(details(replace(base, gap=replace(base.gap, schemes=(scheme,)))))
    harm = "Held out by temperature (the warmest fifth), the correction does harm: 410 µm → 520 µm."
    assert said == ([harm] if shrinkage < 0.0 else [])


def test_robot_and_table_that_do_not_fit_have_no_details(law_case):
    assert list(details(replace(law_case(), misfit=Misfit(away=0.3)))) == []


def test_where_each_is_surer_than_all_together_it_says_what_shares_the_rest(case):
    (said,) = details(replace(case("found"), probability=0.9))
    assert said.startswith("That nothing else is at work is 90.0 % sure, less than each by itself")
    assert said.endswith("joint offset (2.0 %).")
