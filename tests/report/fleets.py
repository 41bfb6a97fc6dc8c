"""A fleet's summary with something in each of its parts."""

SUMMARY = {
    "schema": "thermal-robot/fleet/1",
    "campaigns": 30,
    "robots": 29,
    "labels": ["hall", "model"],
    "outcomes": {"diagnosed": 28, "failed": 1, "unusable": 1},
    "failures": [["hall_1/arm_05", "failed", "measurements.csv, row 3: <nonsense>"]],
    "effects": [
        {
            "effect": "joint_offset", "found": 12, "testable": 28, "confounded": 2,
            "places": {f"joint_{k}": 2 for k in range(6)},
        },
        {"effect": "drift", "found": 0, "testable": 28, "confounded": 0, "places": {}},
    ],
    "gathered": [
        {
            "effect": "joint_offset", "label": "hall", "group": "2", "found": 9, "robots": 10, "found_elsewhere": 3,
            "robots_elsewhere": 18, "p_value": 2e-5,
        }
    ],
    "shared": [
        {
            "effect": "joint_offset", "parameter": "zero offset, joint_2", "unit": "rad", "robots": 28, "mean": 1.4e-4,
            "mean_std": 3e-5, "spread": 2e-5, "spread_std": 9e-6, "p_mean": 0.3, "label": "hall", "p_label": 1e-8,
            "groups": [
                {"group": "2", "robots": 10, "mean": 4.1e-4, "mean_std": 5e-6},
                {"group": "1", "robots": 18, "mean": -2e-6, "mean_std": 4e-6},
            ],
        },
        {
            "effect": "thermal_elongation", "parameter": "strain of fore_arm", "unit": "1/K", "robots": 28,
            "mean": 1.2e-5, "mean_std": 4e-7, "spread": 1.1e-6, "spread_std": 3e-7, "p_mean": 1e-30, "label": "",
            "p_label": 1.0, "groups": [],
        },
    ],
    "apart": [
        {
            "robot": "arm_07", "effect": "backlash", "parameter": "lost motion, joint_4", "unit": "rad",
            "value": 5e-4, "std": 1e-5, "usual": 1e-6, "probability": 0.9999,
        }
    ],
    "found": [
        {
            "robot": f"arm_{k:02d}", "campaign": f"hall/arm_{k:02d}", "rms_before": 2e-4, "rms_after": 3e-5,
            "effect": "joint_offset", "probability": 0.97, "shrinkage": 0.9, "place": "joint_2",
            "confounded_with": ["base_frame"] if k == 1 else [],
        }
        for k in range(20)
    ],
    "parameters": 71,
}  # fmt: skip
"""Of the format ``thermal-robot/fleet/1``."""
EMPTY = {**SUMMARY, "outcomes": {"failed": 30}, "effects": [], "gathered": [], "shared": [], "apart": [], "found": []}
