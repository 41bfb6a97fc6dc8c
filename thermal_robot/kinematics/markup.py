"""XML that is changed in a few places and stays as it stands everywhere else, to the last blank and comment.

A parser that writes a tree anew loses comments, the order of attributes or the digits of numbers. Here it only tells
where the tags stand; the text between the changes is copied.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias
from xml.parsers import expat

Edit: TypeAlias = "tuple[int, int, str]"
"""First byte, byte behind the last one, and the text in its place; an insertion where the two are the same."""

_HIDDEN = re.compile(rb"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?\?>", re.DOTALL)
_START = re.compile(rb"<[^\s/>]+(?:\s+[^\s=>]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*\s*/?>")
_ENCODING = re.compile(rb"(\A\s*<\?xml[^>]*?\sencoding\s*=\s*)(\"[^\"]*\"|'[^']*')")


@dataclass(frozen=True)
class Tag:
    """An element where it begins.

    Attributes
    ----------
    path
        Its name after those of the elements that it stands in, the outermost first.
    attributes
        As the parser reads them.
    start, stop
        First byte of its first tag, and the byte behind that tag.
    close
        First byte of its last tag; ``start`` where it has but one, ``<origin/>``.
    parent
        Number of the element that it stands in; -1 for the outermost.
    """

    path: tuple[str, ...]
    attributes: Mapping[str, str]
    start: int
    stop: int
    close: int
    parent: int

    @property
    def empty(self) -> bool:
        """Whether it has but one tag."""
        return self.close == self.start


def encoded(text: str) -> bytes:
    """Return the bytes whose places are counted: UTF-8, and a declaration that says so."""
    return _ENCODING.sub(rb'\1"utf-8"', text.encode(errors="replace"), count=1)


def tags(content: bytes) -> tuple[Tag, ...]:
    """Return the elements in the order in which they begin; comments are not read, so they may hold anything.

    Raises
    ------
    expat.ExpatError
        If it is no XML.
    """
    seen = _HIDDEN.sub(lambda span: re.sub(rb"[^\n]", b" ", span[0]), content)
    found: list[Tag] = []
    ends: dict[int, int] = {}
    open_: list[int] = []
    parser = expat.ParserCreate("utf-8")

    def begin(name: str, attributes: dict[str, str]) -> None:
        start = parser.CurrentByteIndex
        tag = _START.match(seen, start)
        parent = open_[-1] if open_ else -1
        path = (*(found[parent].path if open_ else ()), name)
        open_.append(len(found))
        found.append(Tag(path, attributes, start, tag.end() if tag else start, start, parent))

    def finish(_: str) -> None:
        ends[open_.pop()] = parser.CurrentByteIndex

    parser.StartElementHandler, parser.EndElementHandler = begin, finish
    parser.Parse(seen, True)
    return tuple(
        Tag(t.path, t.attributes, t.start, t.stop, t.start if seen[t.stop - 2 : t.stop] == b"/>" else ends[k], t.parent)
        for k, t in enumerate(found)
    )


def with_values(content: bytes, tag: Tag, values: Mapping[str, str | None]) -> Edit:
    """Return the change that gives a tag other attributes; ``None`` takes one away, the others stay as they stand."""
    text = content[tag.start : tag.stop].decode()
    for name, value in values.items():
        known = re.search(rf"\s+{re.escape(name)}\s*=\s*(?:\"[^\"]*\"|'[^']*')", text)
        said = "" if value is None else f' {name}="{value}"'
        if known:
            text = text[: known.start()] + said + text[known.end() :]
        elif said:
            end = re.search(r"\s*/?>\Z", text)
            at = end.start() if end else len(text)
            text = text[:at] + said + text[at:]
    return tag.start, tag.stop, text


def changed(content: bytes, edits: Iterable[Edit]) -> str:
    """Return the text with all changes, which do not overlap; those of one place in their order."""
    parts, last = [], 0
    for start, stop, text in sorted(edits, key=lambda edit: edit[:2]):
        parts += [content[last:start], text.encode()]
        last = stop
    return b"".join([*parts, content[last:]]).decode()


def comment(lines: Iterable[str]) -> str:
    """Return lines as an XML comment, which may hold no two hyphens in succession."""
    return "<!--\n" + "\n".join(re.sub(r"-(?=-)", "- ", line) for line in lines).rstrip("-") + "\n-->\n"


def indent(content: bytes, start: int) -> str:
    """Return the blanks before a place in its line, as text that begins a new line there."""
    before = content[content.rfind(b"\n", 0, start) + 1 : start]
    return "\n" + before.decode() if not before.strip() else ""
