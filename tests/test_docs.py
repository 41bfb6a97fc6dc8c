"""What README and docs say is true: links, paths and commands exist, the tutorial runs and prints what it shows."""

import argparse
import ast
import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pages import run, shown_lines_are_printed

import thermal_robot
from thermal_robot import cli

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
PAGES.append(ROOT / "robots" / "README.md")
HISTORY = "CHANGELOG.md"
"""The one page that names paths which are gone."""


def prose(page):
    """The page without its fenced blocks."""
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(page):
    """The anchors that GitHub gives to the headings of a page."""
    titles = re.findall(r"^#+ (.+)$", prose(page), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def of_pages(pattern, text=lambda page: page.read_text(encoding="utf-8")):
    """Yield (page, what a pattern finds in it)."""
    yield from ((page, found) for page in PAGES for found in re.findall(pattern, text(page)))


def test_every_relative_link_leads_somewhere():
    missing = []
    for page, target in of_pages(r"\]\(([^)\s]+)\)", prose):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or (anchor and anchor not in anchors(file)):
            missing.append((page.name, target))
    assert missing == []


def found(dotted):
    """Whether ``thermal_robot.a.b`` is a module, or a name in one."""
    parts = dotted.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        for name in parts[cut:]:
            if not hasattr(thing, name):
                return False
            thing = getattr(thing, name)
        return True
    return False


def test_a_dotted_path_is_found_or_not():
    assert found("thermal_robot.campaign.read.read_campaign")
    assert found("thermal_robot.Diagnosis.to_json")
    assert not found("thermal_robot.no_such_room")
    assert not found("thermal_robot.Diagnosis.no_such_method")


def test_every_dotted_path_imports():
    named = of_pages(r"(?<![\w/])(thermal_robot(?:\.[A-Za-z_]\w*)+)(?![\w/])")
    known = {name for page, name in named if page.name != HISTORY}
    data = {"thermal_robot.effects"}  # also the name of an entry point group
    assert [name for name in sorted(known - data) if not found(name)] == []


def options():
    """Options (set of strings) of every command of the program."""
    chosen = next(a for a in cli._parser()._actions if isinstance(a, argparse._SubParsersAction))
    return {name: {o for a in sub._actions for o in a.option_strings} for name, sub in chosen.choices.items()}


def test_every_command_and_option_exists():
    known = options()
    for page, (command, rest) in of_pages(r"thermal-robot ([a-z][a-z0-9]*)\b([^`\n]*)"):
        assert command in known, f"{page.name}: thermal-robot {command}"
        used = set(re.findall(r"(?<!\S)\[?(--?[a-z][\w-]*)", rest.split("#")[0]))
        assert used <= known[command], f"thermal-robot {command}{rest}"


def test_the_page_of_commands_has_every_command_and_every_option():
    text = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    of_all = set.intersection(*options().values())
    assert {o for o in of_all if f"`{o}`" not in text[: text.index("\n## ")]} == set()
    for command, own in options().items():
        part = re.search(rf"^## `thermal-robot {command}`.*?(?=^## |\Z)", text, flags=re.M | re.S)
        assert part, command
        missing = {o for o in own if o.startswith("--") and o not in part.group(0)} - of_all
        assert missing == set(), command


def test_the_page_of_the_api_has_every_public_name():
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    assert [name for name in thermal_robot.__all__ if f"`{name}`" not in text and f"`{name}(" not in text] == []


def test_the_map_names_every_page():
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    pages_of_docs = {p.name for p in (ROOT / "docs").glob("*.md")} - {"index.md"}
    assert {name for name in pages_of_docs if f"({name})" not in text} == set()


def test_a_line_that_is_not_printed_is_noticed():
    shown_lines_are_printed("…\na 1.100 µm\n", "x\n  a  1.102 µm\n")
    with pytest.raises(AssertionError, match="not printed"):
        shown_lines_are_printed("a 1 mm", "a 1 µm")
    with pytest.raises(AssertionError, match="other figures"):
        shown_lines_are_printed("a 1.0 µm", "a 1.1 µm")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "texts"), [("tutorial", 8), ("tracker", 7), ("add_an_effect", 4), ("motion_tutorial", 1)]
)
def test_a_page_runs_and_prints_what_it_shows(name, texts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert run(ROOT / "docs" / f"{name}.md", tmp_path) >= texts
    for declared in tmp_path.glob("pyproject.toml"):
        offered = tomllib.loads(declared.read_text(encoding="utf-8"))["project"]["entry-points"][
            "thermal_robot.effects"
        ]
        for effect, where in offered.items():
            module, attribute = where.split(":")
            assert getattr(importlib.import_module(module), attribute).name == effect


def test_a_page_that_fails_without_saying_so_is_noticed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = tmp_path / "page.md"
    page.write_text("```bash\nthermal-robot check absent\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError):
        run(page, tmp_path)


def test_every_room_has_a_line_in_contributing():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rooms = [info.name for info in pkgutil.iter_modules(thermal_robot.__path__)]
    assert [room for room in rooms if f"`{room}" not in text and f"/{room}" not in text] == []


def test_the_number_that_contributing_follows(diagnosed_once):
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    campaign = thermal_robot.demo_campaign()
    found = diagnosed_once(campaign)
    assert found.rows.rows[67] == 69
    assert f"−{-campaign.position[67, 0]:.6f} m" in text
    told = re.findall(r"(?:gap of|remainder of|\|) (\d+) µm", text)
    distance = [np.linalg.norm(part[67]) for part in (found.rows.gap, found.rows.remainder)]
    np.testing.assert_allclose([*distance, found.rows.held_out_after[67]], [1e-6 * float(t) for t in told], atol=2e-6)
    assert f"−{-1e3 * found.model.prediction(campaign)[0][67, 0]:.3f} mm" in text


def named_files(line):
    """Paths that a line names, from the root; a file without a folder is of the folder named before it on the line."""
    folder = None
    for name in re.findall(r"`([\w/.]+)`", line):
        if re.match(r"(thermal_robot|tests|robots|docs|notebooks)/", name):
            folder = name if name.endswith("/") else name.rsplit("/", 1)[0] + "/"
            yield name
        elif folder and re.fullmatch(r"\w+\.py", name):
            yield folder + name


def test_every_file_that_is_named_exists():
    lines = of_pages(r"(?m)^.*$")
    named = {(page.name, name) for page, line in lines for name in named_files(line)}
    assert [at for at in sorted(named) if not (ROOT / at[1]).exists()] == []


def said_in_the_program():
    """All texts of the package, what is put into them as `…`."""
    texts = []
    for module in sorted((ROOT / "thermal_robot").rglob("*.py")):
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = (part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
                texts.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts.append(node.value)
    return texts


@pytest.mark.slow
def test_every_message_that_is_explained_is_one_of_the_program():
    page = prose(ROOT / "docs" / "troubleshooting.md")
    messages = re.findall(r"^\| `([^|]+)` \|", page, flags=re.M)
    assert len(messages) >= 30
    texts = {text.replace("`", "") for text in said_in_the_program()}
    unsaid = []
    for message in messages:
        parts = message.split("…")
        pattern = re.compile(".+".join(map(re.escape, parts)))
        if not any(pattern.search(text) for text in texts if all(part in text for part in parts)):
            unsaid.append(message)
    assert unsaid == []


# ---- the site


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site as `mkdocs build -f .mkdocs.yml --strict` does; its folder."""
    pytest.importorskip("mkdocs", reason="mkdocs is not installed: the extra docs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "-f", str(ROOT / ".mkdocs.yml"), "--strict", "-d", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def test_every_page_is_in_it(site):
    for page in (ROOT / "docs").glob("*.md"):
        named = page.stem if page.stem != "index" else ""
        assert (site / "docs" / named / "index.html").is_file(), page.name


def test_the_reference_tells_arguments_and_errors(site):
    shown = (site / "docs" / "reference" / "index.html").read_text(encoding="utf-8")
    assert "CampaignError" in shown
    assert "held_out" in shown or "joint_names" in shown


def test_nothing_is_fetched_from_elsewhere(site):
    start = (site / "index.html").read_text(encoding="utf-8")
    assert "fonts.googleapis.com" not in start
