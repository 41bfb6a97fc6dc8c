"""Commands that take one campaign: check, effects, diagnose, crash, demo, view, iso9283."""

from __future__ import annotations

import argparse
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from thermal_robot.campaign import Campaign, describe, write_predictions
from thermal_robot.campaign.description import aligned
from thermal_robot.commands.shared import as_json, as_page, deliver, read, read_from, tell
from thermal_robot.console import stages
from thermal_robot.datasets import demo_campaign, demo_directory
from thermal_robot.errors import CampaignError, EstimationError
from thermal_robot.files import require_free, write_one

if TYPE_CHECKING:
    from thermal_robot.diagnosis import Diagnosis
    from thermal_robot.effects import Effect
    from thermal_robot.motion.result import MotionDiagnosis


def check(options: argparse.Namespace) -> None:
    """Run ``check``: read a campaign or a log of motion, and print its description; no effect is fitted."""
    from thermal_robot.motion.read import declares_motion

    if not declares_motion(Path(options.campaign)):
        return tell(options, _foretold(read(options)))
    from thermal_robot.motion import find_faults, read_motion
    from thermal_robot.motion.description import text

    log = read_motion(options.campaign, folder=Path() if options.piped else None)
    return tell(options, text(log, find_faults(log)))


def _foretold(campaign: Campaign) -> str:
    """Describe a campaign, and what a diagnosis says before it fits: rows that count, misfit, effects not testable."""
    from thermal_robot.diagnosis.data_checks import counted
    from thermal_robot.diagnosis.data_faults.misfit import mismatch
    from thermal_robot.inference.fit import require_enough
    from thermal_robot.report.words import misfit_sentences

    if not campaign.measured or not campaign.samples:
        return describe(campaign)
    kept, notes = counted(campaign)
    said = [("rows that count", f"{kept.samples} of {campaign.samples}")]
    misfit = None
    try:
        misfit = mismatch(kept)
        if misfit is None:  # the order of a diagnosis
            require_enough(kept)
    except EstimationError as error:
        said.append(("none is possible", str(error)))
    if misfit:
        said.append(("no effect", next(misfit_sentences(misfit, kept.reach))))
    else:
        lacking: dict[str, list[str]] = {}
        for effect, asked in _needs(kept):
            if asked:
                lacking.setdefault(asked, []).append(effect.name)
        said += [("not testable", f"{', '.join(names)}: add {asked}") for asked, names in lacking.items()]
    block = "\n".join(["What a diagnosis would say first", *aligned(iter(said))])
    return f"{describe(replace(campaign, warnings=(*campaign.warnings, *notes)))}\n\n{block}"


def _needs(campaign: Campaign) -> Iterator[tuple[Effect, str]]:
    """Yield every known effect, and what the campaign lacks for it, in words; empty where nothing."""
    from thermal_robot.diagnosis import Finding
    from thermal_robot.effects import gate, library
    from thermal_robot.effects.catalogue import random_effects
    from thermal_robot.observations import observe
    from thermal_robot.report.words import needs

    observations = observe(campaign)
    for effect in (*library().values(), *random_effects()):
        missing = gate.missing(effect, observations)
        yield effect, needs(Finding(effect.name, "not_testable", needs=missing), campaign.robot.joint_names)


def effects(options: argparse.Namespace) -> None:
    """Run ``effects``: list the effects, with the columns that a campaign lacks for each."""
    bare = options.campaign is None  # poses and nothing else
    campaign = replace(demo_campaign(), covariates={}, labels={}) if bare else read(options)
    known = [*_needs(campaign)]
    wide = max(len(effect.name) for effect, _ in known)
    print("Effects that are considered, and what each needs beside measured poses:" if bare else campaign.name)
    for effect, asked in known:
        print(f"  {effect.name:{wide}}  {effect.title}{f'; needs {asked}' if asked else ''}")


def diagnosed(options: argparse.Namespace) -> Diagnosis | Any:
    """Read and diagnose the named campaign or log of motion, with progress by stages on the console."""
    from thermal_robot import diagnosing

    with stages(options.loudness) as progress:
        progress("reading the campaign")
        given = diagnosing.read(options.campaign, folder=Path() if options.piped else None)
        return diagnosing.diagnose(given, only=options.only, without=options.without, progress=progress)


def diagnose(options: argparse.Namespace) -> None:
    """Run ``diagnose``: diagnose a campaign or a log of motion, print the result and write the requested files.

    :class:`CampaignError` after that if no corrected model can be had of the campaign.
    """
    from thermal_robot.motion.read import declares_motion
    from thermal_robot.report import html

    if declares_motion(Path(options.campaign)):
        return _diagnose_motion(options)
    for name in ("mjcf", "urdf", "from_mjcf", "unseen"):
        if getattr(options, name):
            column = f"--{name.replace('_', '-')}"
            raise CampaignError("diagnose", "is for logs of motion", column=column, expected="`correct` with a model")
    files = read_from(options.campaign, Path() if options.piped else None)
    require_free((options.json, options.model, options.report), files)
    found = diagnosed(options)
    outputs = [
        (options.json, found.to_json),
        as_page(options.report, html, found, files, lambda file: file.name),
        (options.model if found.usable else None, lambda path: found.model.save(path)),
    ]
    deliver(options, outputs, str(found), found.summary)
    if not found.usable:
        raise CampaignError(str(options.campaign), found.reason)
    return None


def _diagnose_motion(options: argparse.Namespace) -> None:
    from thermal_robot.commands.motion_files import motion_files
    from thermal_robot.motion.read import files_of
    from thermal_robot.report import motion_html

    if options.model:
        raise CampaignError(
            "diagnose", "no model of poses comes of a log of motion", column="--model", expected="no such option"
        )
    files = files_of(options.campaign, Path() if options.piped else None)
    require_free((options.json, options.report, options.mjcf, options.urdf), files)
    found = diagnosed(options)
    page = as_page(options.report, motion_html, found, files, lambda file: file.name)
    robot_files = motion_files(options, cast("MotionDiagnosis", found))
    deliver(options, [(options.json, found.to_json), page, *robot_files], str(found), found.summary)


def demo(options: argparse.Namespace) -> None:
    """Run ``demo``: diagnose the simulated campaign of the package, print the result and write its page."""
    from thermal_robot.report import html

    options.campaign = demo_directory()
    intro = f"The demo's campaign is simulated; its answer lies in {options.campaign / 'truth.json'}."
    found = diagnosed(options)
    tell(options, f"{intro}\n\n{found}", found.summary)
    write_one(options.report, as_page(options.report, html, found)[1])
    tell(options, f"Drawn in {options.report}")


def crash(options: argparse.Namespace) -> None:
    """Run ``crash``: find which joint zero or link a crash moved, print it and write the requested JSON file."""
    from thermal_robot.diagnosis.crash import after_crash
    from thermal_robot.report import crash_headline

    require_free((options.json,), read_from(options.campaign, Path() if options.piped else None))
    with stages(options.loudness) as progress:
        found = after_crash(read(options), progress=progress)
    deliver(options, [as_json(options.json, found.to_dict())], str(found), crash_headline(found))


def iso9283(options: argparse.Namespace) -> None:
    """Run ``iso9283``: compute the standard's performance criteria from repeats, print and write them."""
    from thermal_robot.iso9283 import performance

    require_free((options.json, options.csv), read_from(options.campaign, Path() if options.piped else None))
    found = performance(read(options))
    table = (options.csv, lambda path: write_predictions(path, found.to_frame()))
    deliver(options, [as_json(options.json, found.to_dict()), table], str(found), found.summary)


def view(options: argparse.Namespace) -> None:
    """Run ``view``: serve a 3-D scene of robot and gap to the browser until interrupted; needs viser."""
    try:
        import viser  # noqa: F401
    except ImportError as error:
        problem, extra = "the viewer needs viser, which is not installed", 'pip install "thermal-robot[viewer]"'
        raise CampaignError("view", problem, expected=extra) from error
    from thermal_robot.viewer.scene import scene_of_campaign, scene_of_diagnosis
    from thermal_robot.viewer.window import Window, solids

    scene = scene_of_campaign(read(options)) if options.no_diagnosis else scene_of_diagnosis(diagnosed(options))
    robot = scene.robot
    window = Window(scene, solids(robot.urdf, robot.folder or Path(), scene.size), options.port)
    try:
        tell(options, f"{window.url} shows {scene.title}; Ctrl-C ends it", window.url)
        sys.stdout.flush()  # nothing more is printed for hours
        if options.open:
            import webbrowser

            webbrowser.open(window.url)
        threading.Event().wait()
    finally:
        window.close()
