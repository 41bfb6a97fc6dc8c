"""Which arms are compiled in a commit: numba takes ten seconds for each."""

import pytest

COMPILED = ("rv_m2", "awkward-from-base")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Leave the compiled engine on other arms to the slow tests."""
    for item in items:
        drawn = getattr(item, "callspec", None)
        if drawn and drawn.params.get("engine") == "compiled" and drawn.params.get("arm", COMPILED[0]) not in COMPILED:
            item.add_marker(pytest.mark.slow)
