"""Pages of the documentation: their fenced blocks, and whether what they show is what is printed."""

import contextlib
import io
import re
import shlex

import pytest

from thermal_robot import cli

FIGURE = r"[−-]?\d+(?:\.\d+)?(?:e-?\d+)?"


def blocks(page):
    """(language, text) of every fenced block, in order."""
    return re.findall(r"^```(\w+)\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def run(page, folder, names=None):
    """Run the blocks of a page in the current folder; return how many texts were compared with what was printed.

    Python and commands are run, in order; a block that begins with ``# name.ending`` is written to that file. A text
    is what the block before it prints. A command that ends with another status than 0 must say so in such a text.
    """
    names, printed, refused, checked = {} if names is None else names, "", "", 0
    for language, text in blocks(page):
        file = re.match(r"# (\w+\.\w+)\n", text)
        if language == "text":
            shown_lines_are_printed(text, printed)
            refused, checked = "", checked + 1
            continue
        assert not refused, f"nothing is shown of a failure: {refused}"
        if file:
            (folder / file[1]).write_text(text, encoding="utf-8")
        elif language == "csv":
            (folder / "samples.csv").write_text(text, encoding="utf-8")
        else:
            printed, refused = _printed(language, text, page.name, names)
    assert not refused
    return checked


def _printed(language, text, name, names):
    """What a block prints, and what it says of a failure."""
    out, failed = io.StringIO(), ""
    with contextlib.redirect_stdout(out):
        if language == "python":
            exec(compile(text, name, "exec"), names)
            return out.getvalue(), ""
        for line in text.splitlines():
            program, *arguments = shlex.split(line)
            assert program == "thermal-robot"
            if cli.main(arguments) != cli.DONE:
                failed = line
    return out.getvalue(), failed


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
