"""The command ``thermal-robot check``."""

from __future__ import annotations

import argparse

from thermal_robot.commands.shared import CAMPAIGN, read, tell

DOES = "validate and describe a campaign; nothing is fitted"
EXAMPLE = " campaign.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot check``."""
    parser.add_argument("campaign", help=CAMPAIGN)
    parser.set_defaults(run=run, reads=("campaign",))


def run(options: argparse.Namespace) -> None:
    """Read a campaign and describe it."""
    from thermal_robot.campaign import describe

    tell(options, describe(read(options)))
