"""Pages of this room as files: HTML, or PDF by WeasyPrint, the same text and figures on numbered sheets of A4."""

from __future__ import annotations

import re
from pathlib import Path

from thermal_robot.errors import CampaignError
from thermal_robot.files import write_bytes, write_text

_COLOUR = re.compile(r"var\(--tr-\w+,(#\w+)\)")  # of a figure: WeasyPrint takes the colour itself
_SCRIPT = re.compile(r"<script[^>]*>.*?</script>", re.DOTALL)  # paper runs none
_ON_PAPER = ".tr-arm { display: none; }"  # what a script would draw


def is_pdf(target: str | Path | None) -> bool:
    """Whether a file is to be a PDF by its ending."""
    return Path(target or "").suffix.lower() == ".pdf"


def require_pdf(target: str | Path | None) -> None:
    """Refuse a PDF where what makes it is not installed, before anything is computed.

    Raises
    ------
    CampaignError
        It names the extra; or the library of the system that WeasyPrint lacks.
    """
    if not is_pdf(target):
        return
    try:
        import weasyprint  # noqa: F401
    except ImportError as error:
        problem, extra = "a PDF needs WeasyPrint, which is not installed", 'pip install "thermal-robot[pdf]"'
        raise CampaignError(str(target), problem, expected=f"{extra}; or a page, F.html") from error
    except OSError as error:
        problem, found = "a PDF needs Pango, which WeasyPrint does not find", str(error).splitlines()[0]
        raise CampaignError(str(target), problem, found=found, expected="Pango of the system; or F.html") from error


def write_page(path: str | Path, page: str, target: str | Path | None = None) -> None:
    """Write a page that :func:`~thermal_robot.report.page.render` made, as PDF where the ``target`` is one by its name.

    Raises
    ------
    CampaignError
        Where WeasyPrint is missing.
    """
    target = path if target is None else target
    if not is_pdf(target):
        return write_text(path, page)
    require_pdf(target)
    import weasyprint

    drawn = _COLOUR.sub(r"\1", _SCRIPT.sub("", page))
    paper = weasyprint.CSS(string=_ON_PAPER)
    return write_bytes(path, weasyprint.HTML(string=drawn).write_pdf(stylesheets=[paper]))
