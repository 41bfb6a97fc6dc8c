"""Campaigns of known answers are diagnosed once in a run, by whoever asks first."""

import pytest

import thermal_robot


@pytest.fixture(scope="module", autouse=True)
def one_diagnosis_of_a_campaign(diagnosed_once):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(thermal_robot, "diagnose", diagnosed_once)
        yield
