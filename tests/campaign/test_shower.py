"""Who shows a campaign can be replaced; without anybody that is said."""

import pytest

from thermal_robot import demo_campaign
from thermal_robot.campaign.campaign import shower, shown_by


class Own:
    """Shows a campaign's name alone."""

    def frame(self, campaign):
        return campaign.name

    def html(self, campaign):
        return f"<b>{campaign.name}</b>"


@pytest.fixture(autouse=True)
def as_it_was():
    before = shower()
    yield
    shown_by(before)


def test_the_last_one_that_was_registered_shows_campaigns():
    shown_by(Own())
    assert demo_campaign().to_frame() == "demo"
    assert demo_campaign()._repr_html_() == "<b>demo</b>"


def test_nobody_is_an_error(monkeypatch):
    monkeypatch.setattr("thermal_robot.campaign.campaign._showers", [])
    with pytest.raises(RuntimeError, match="nobody can show a campaign"):
        shower()
