"""Arms that nobody thought of: any kinds of joints, axes, origins, masses, branches and mimics, drawn by Hypothesis.

An ordinary run draws the same few examples each time. ``HYPOTHESIS_PROFILE=long`` draws other ones, ten times as many.
"""

import os

from coupled import joint, link, urdf
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from thermal_robot.robot import load_robot

_SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.differing_executors]
settings.register_profile(
    "short", max_examples=20, derandomize=True, deadline=None, database=None, suppress_health_check=_SLOW
)
settings.register_profile("long", max_examples=200, deadline=None, database=None, suppress_health_check=_SLOW)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "short"))

MOST = 9
"""Moving joints."""
KINDS = ("revolute", "continuous", "prismatic")
LIMITS = {"revolute": (-2.9, 2.6), "prismatic": (-0.4, 0.7), "continuous": None}


def _three(lowest, highest):
    """Three numbers of two decimals; zero, which Hypothesis likes, among them."""
    return st.tuples(*[st.integers(lowest, highest)] * 3).map(lambda n: " ".join(repr(k / 100) for k in n))


AXES = _three(-300, 300).filter(lambda text: any(map(float, text.split())))


@st.composite
def _link(draw, name):
    return link(name, draw(st.sampled_from([0.0, 0.3, 2.0, 8.0])), draw(_three(-30, 30)))


@st.composite
def _mimic(draw, drivers):
    """The attributes of a mimic tag, or nothing."""
    if not drivers or draw(st.integers(0, 3)):
        return ""
    times, offset = draw(st.sampled_from([-1.0, 0.5, 2.0])), draw(st.sampled_from([0.0, 0.2]))
    return f'joint="{draw(st.sampled_from(drivers))}" multiplier="{times}" offset="{offset}"'


@st.composite
def urdfs(draw):
    """Text of a URDF of which ``tip`` is the last link; fixed joints between, a branch here and there."""
    parts, drivers, parent = [draw(_link("base"))], [], "base"
    for k in range(draw(st.integers(1, MOST))):
        if not draw(st.integers(0, 3)):
            child = f"post_{k}"
            placed = {"origin": draw(_three(-50, 50)), "rpy": draw(_three(-314, 314))}
            parts += [draw(_link(child)), joint(f"mount_{k}", "fixed", parent, child, **placed)]
            parent = child if draw(st.booleans()) else parent
        kind, child = draw(st.sampled_from(KINDS)), f"link_{k}"
        mimic = draw(_mimic(drivers))
        placed = {"origin": draw(_three(-50, 50)), "rpy": draw(_three(-314, 314)), "axis": draw(AXES)}
        parts += [draw(_link(child)), joint(f"q_{k}", kind, parent, child, limits=LIMITS[kind], mimic=mimic, **placed)]
        drivers += [] if mimic else [f"q_{k}"]
        if not draw(st.integers(0, 5)):  # a joint beside the chain, which what comes behind may mimic
            aside = draw(st.sampled_from(KINDS))
            parts += [link(f"aside_{k}"), joint(f"beside_{k}", aside, parent, f"aside_{k}", limits=LIMITS[aside])]
            drivers.append(f"beside_{k}")
        parent = child
    end = joint("tip_joint", "fixed", parent, "tip", draw(_three(-20, 20)), draw(_three(-314, 314)))
    return urdf(*parts, link("tip"), end)


def arms():
    """Robots of such texts."""
    return urdfs().map(lambda text: load_robot(text, "tip"))
