"""Which arm is compiled in a commit: numba takes half a minute for one."""

import pytest

COMPILED = "awkward-from-base"
"""The one with joints of every kind, which the other tests of this engine compile, too."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Leave the compiled engine on other arms to the slow tests."""
    for item in items:
        drawn = getattr(item, "callspec", None)
        if drawn and drawn.params.get("engine") == "compiled" and drawn.params.get("arm", COMPILED) != COMPILED:
            item.add_marker(pytest.mark.slow)
