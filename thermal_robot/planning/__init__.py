"""Experimental design of a first campaign: commands, and the expected precision of each effect."""

from thermal_robot.planning.plan import CRASH_ROWS, ROWS, Expected, ExpectedParameter, Plan, plan, text, write_plan

__all__ = ["CRASH_ROWS", "ROWS", "Expected", "ExpectedParameter", "Plan", "plan", "text", "write_plan"]
