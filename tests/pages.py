"""Pages of the documentation: their fenced blocks, and whether what they show is what is printed."""

import re

import pytest

FIGURE = r"[−-]?\d+(?:\.\d+)?(?:e-?\d+)?"


def blocks(page):
    """(language, text) of every fenced block, in order."""
    return re.findall(r"^```(\w+)\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def masked(line):
    """A line without its figures, and the figures."""
    figures = re.findall(FIGURE, line)
    return re.sub(FIGURE, "#", " ".join(line.split())), [float(f.replace("−", "-")) for f in figures]


def shown_lines_are_printed(shown, printed):
    """Every line that a page shows is printed: the same words, figures as printed, but for their last digit."""
    real = [masked(line) for line in printed.splitlines()]
    for line in shown.splitlines():
        if line.strip() in ("", "…"):
            continue
        words, figures = masked(line)
        alike = [f for w, f in real if w == words]
        assert alike, f"not printed: {line}"
        assert any(f == pytest.approx(figures, rel=0.005, abs=0.005) for f in alike), f"other figures: {line}"
