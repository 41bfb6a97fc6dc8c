"""Pages of this room as files: HTML, or PDF by WeasyPrint, the same text and figures on numbered sheets of A4."""

from __future__ import annotations

import re
from pathlib import Path

from thermal_robot.files import write_bytes, write_text

_COLOUR = re.compile(r"var\(--tr-\w+,(#\w+)\)")  # of a figure: WeasyPrint takes the colour itself
_SCRIPT = re.compile(r"<script[^>]*>.*?</script>", re.DOTALL)  # paper runs none
_ON_PAPER = ".tr-arm { display: none; }"  # what a script would draw


def write_page(path: str | Path, page: str, target: str | Path | None = None) -> None:
    """Write an HTML page that :func:`~thermal_robot.report.page.render` made; as PDF where ``target`` ends in .pdf.

    The ``target`` is the ``path`` itself where absent.

    Raises
    ------
    ImportError, OSError
        Where WeasyPrint is missing, or Pango, which it needs of the system.
    """
    if Path(target or path).suffix.lower() != ".pdf":
        return write_text(path, page)
    import weasyprint

    drawn = _COLOUR.sub(r"\1", _SCRIPT.sub("", page))
    paper = weasyprint.CSS(string=_ON_PAPER)
    return write_bytes(path, weasyprint.HTML(string=drawn).write_pdf(stylesheets=[paper]))
