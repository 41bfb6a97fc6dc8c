"""A comparison of any number of campaigns with something in each of its parts."""

from itertools import combinations

from report.cases import JOINTS

NAMES = ("january", "march_after_overhaul", "june", "september", "december", "next_january", "april", "july")


def comparison(count):
    """Of the format ``thermal-robot/comparison/1``: play grows from campaign to campaign, zeros stay."""
    names = NAMES[:count]
    zeros = [
        _parameter(f"zero offset, {j}", j, [(-1) ** k * (1e-3 + 1e-4 * k)] * count, 9e-6) for k, j in enumerate(JOINTS)
    ]
    play = [_parameter(f"lost motion, {j}", j, [1e-4 * (1 + k) for k in range(count)], 2e-5) for j in JOINTS]
    hidden = {**zeros[0], "values": [1e-3, *[None] * (count - 1)], "stds": [9e-6, *[None] * (count - 1)]}
    said = "The gap of 516 µm comes from joint zero offsets and a smaller one (98 % sure); correcting removes 98.8 %."
    named = list(names)
    shared = {
        "status": "shared",
        "reason": "",
        "probability": 0.9999,
        "named": named,
        "chi2": 8.1,
        "degrees": 16,
        "p_value": 0.94,
    }
    changed = {**shared, "status": "changed", "chi2": 950.8, "p_value": 4e-192}
    change = {
        "effect": "backlash", "title": "lost motion in the joints", "kind": "joint", "place": JOINTS[2],
        "parameters": [play[2]["name"]], "groups": [[name] for name in names], "since": "", "unit": "rad",
        "values": play[2]["values"], "chi2": 545.8, "degrees": 12, "p_value": 2e-75, "probability": 0.9999,
    }  # fmt: skip
    return {
        "schema": "thermal-robot/comparison/1",
        "robot": "ur10",
        "tool_frame": "tool0",
        "campaigns": [{"name": name, "samples": 60, "diagnosis": said} for name in names],
        "verdict": {"effects": ["joint_offset", "backlash"], "lost": [], "changed": True},
        "changes": [change],
        "effects": [
            {"name": "joint_offset", "title": "joint zero offsets", "parameters": [*zeros[1:], hidden], **shared},
            {"name": "backlash", "title": "lost motion in the joints", "parameters": play, **changed},
        ],
        "predicted": [
            {
                "campaigns": [*pair], "poses": 103, "rms": 5.4e-5, "stated": 5.5e-5, "beyond": 0.5, "note": "",
                "agrees": bool(k % 2),
            }
            for k, pair in enumerate(combinations(names, 2))
        ],
        "not_told": [f"translation z of {j}" for j in JOINTS],
    }  # fmt: skip


def _parameter(name, place, values, std):
    difference = values[-1] - values[0]
    return {
        "name": name, "kind": "joint", "place": place, "unit": "rad", "values": values, "stds": [std] * len(values),
        "between": [NAMES[0], NAMES[len(values) - 1]], "difference": difference, "std": 1.4 * std, "chi2": 2.0,
        "degrees": len(values) - 1, "p_value": 4.8e-88 if difference else 0.74,
    }  # fmt: skip
