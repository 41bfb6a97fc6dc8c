"""Every number that was chosen has its reason, and is one that can be."""

import ast
from pathlib import Path

from thermal_robot.fleet import compare_settings


def test_every_number_has_a_reason():
    body = ast.parse(Path(compare_settings.__file__).read_text(encoding="utf-8")).body
    for number, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(number, ast.Assign):
            assert isinstance(after, ast.Expr)
            assert len(after.value.value.split()) > 8


def test_probabilities_are_probabilities():
    for name in ("MAY_BE", "CHANGED", "EVERYWHERE", "FALSE_CHANGE", "AGREE", "MOST", "DISTINCT"):
        assert 0.0 < getattr(compare_settings, name) < 1.0, name
