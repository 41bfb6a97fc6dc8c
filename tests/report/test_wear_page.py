"""The page of a robot over time."""

from wear_cases import by_hand

from thermal_robot.report import wear_html


def test_the_page_tells_what_rings_and_stands_alone():
    page = wear_html(by_hand(), "then", {"campaign.toml": "abc123"})
    assert "zero offset, elbow jumped by" in page
    assert "2026-07-20 (2026-06-30 to 2026-08-19)" in page
    assert "cannot be compared: unknown frames hide its changes" in page
    assert "a &lt;note&gt; to know" in page
    assert "abc123" in page
    assert "http:" not in page
    assert page.count("<svg") == 1


def test_equal_results_give_equal_pages():
    assert wear_html(by_hand()) == wear_html(by_hand())
