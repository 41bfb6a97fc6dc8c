"""Campaigns that come with the package."""

from __future__ import annotations

from pathlib import Path

from thermal_robot.campaign import Campaign, read_campaign


def demo_directory() -> Path:
    """Folder of the demo's campaign; its ``truth.json`` holds the effects that were simulated."""
    return Path(__file__).parent / "data" / "demo"


def demo_campaign() -> Campaign:
    """Read the demo's campaign: simulated, with a stated seed.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> tr.demo_campaign()
    <Campaign 'demo': 120 samples of position, 5 joints, 8 covariates>
    """
    return read_campaign(demo_directory())
