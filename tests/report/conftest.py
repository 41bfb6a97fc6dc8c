"""What tests of the report share: each kind of diagnosis, real ones, and pages that are written once."""

from functools import lru_cache

import pytest
from report.browser import Browser
from report.cases import CASES
from simulate import simulate

import thermal_robot as tr
from thermal_robot.report.drawing import Drawing


@pytest.fixture(params=[kind for kind in CASES if kind != "law"])
def diagnosis(request):
    """Each kind in turn."""
    return CASES[request.param]()


@pytest.fixture(scope="session")
def drifted(rv_m2, diagnosed_once):
    """A real diagnosis: the base has drifted."""
    return diagnosed_once(simulate(rv_m2, ["drift"], seed=3)[0])


@pytest.fixture(scope="session")
def demo(diagnosed_once):
    """The diagnosis of the demo."""
    return diagnosed_once(tr.demo_campaign())


@pytest.fixture(scope="session")
def zeros(diagnosed_once):
    """Two zeros, which a file holds, and lost motion, which none does."""
    worn = {"joint_offset": {"joint_2": 2e-3, "joint_4": -1e-3}, "backlash": {"joint_3": 4e-4}}
    tool = (0.1, 0.0, 0.08)
    campaign = tr.simulate("builtin:rv_m2", worn, tool_frame="tool0", rows=80, noise=2e-5, tool=tool)
    return diagnosed_once(campaign, only=[*worn])


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """One browser for all pages."""
    made = Browser(tmp_path_factory.mktemp("profile"))
    yield made
    made.close()


@pytest.fixture(scope="session")
def written():
    """Write the page or fragment of a kind, once for all tests."""
    return lru_cache(lambda write, kind: write(CASES[kind]()))


@pytest.fixture
def no_drawing(monkeypatch):
    """Leave the figures out, where a test is about the words."""
    monkeypatch.setattr(Drawing, "savefig", lambda self, stream, **_: stream.write("<svg></svg>"))
