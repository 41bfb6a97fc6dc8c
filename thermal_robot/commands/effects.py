"""The command ``thermal-robot effects``."""

from __future__ import annotations

import argparse

from thermal_robot.commands.shared import CAMPAIGN, read

DOES = "list the effects that are considered, and what each needs"
EXAMPLE = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot effects``."""
    parser.add_argument("campaign", nargs="?", help=f"{CAMPAIGN}; what it recorded is then not asked for")
    parser.set_defaults(run=run, reads=("campaign",))


def run(options: argparse.Namespace) -> None:
    """Print the effects, and what a campaign lacks for each."""
    from dataclasses import replace

    from thermal_robot.datasets import demo_campaign
    from thermal_robot.diagnosis import Finding
    from thermal_robot.effects import gate, library
    from thermal_robot.effects.catalogue import random_effects
    from thermal_robot.observations import observe
    from thermal_robot.report.words import needs

    bare = options.campaign is None  # poses and nothing else
    campaign = replace(demo_campaign(), covariates={}, labels={}) if bare else read(options)
    known, observations = (*library().values(), *random_effects()), observe(campaign)
    wide = max(len(effect.name) for effect in known)
    print("Effects that are considered, and what each needs beside measured poses:" if bare else campaign.name)
    for effect in known:
        missing = gate.missing(effect, observations)
        asked = needs(Finding(effect.name, "not_testable", needs=missing), campaign.robot.joint_names)
        print(f"  {effect.name:{wide}}  {effect.title}{f'; needs {asked}' if asked else ''}")
