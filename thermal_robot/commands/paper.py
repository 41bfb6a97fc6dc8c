"""The command ``thermal-robot paper``."""

from __future__ import annotations

import argparse

from thermal_robot.files import write_one, write_text

DOES = "print the figures of the paper beside the computed ones"
EXAMPLE = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot paper``."""
    parser.add_argument("--json", metavar="F", help="write the ledger as JSON ('-' prints it instead of the text)")
    parser.add_argument("--l5", metavar="M", type=float, help="wrist to tool point, m (default: 0.150, assumed)")
    parser.add_argument("--markdown", action="store_true", help="print the table of docs/paper.md instead of the text")
    parser.set_defaults(run=run, writes=("json",))


def run(options: argparse.Namespace) -> None:
    """Print the ledger, and write it where that is asked for."""
    import json

    from thermal_robot.paper import PaperInputs, ledger

    found = ledger(PaperInputs() if options.l5 is None else PaperInputs(l5=options.l5))
    if options.json:
        plain = json.dumps(found.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
        write_one(options.json, lambda path: write_text(path, plain + "\n"))
    if not options.printed:
        print(found.markdown() if options.markdown else found.text())
