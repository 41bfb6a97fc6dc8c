"""Experimental design of a first campaign: commands, and the expected precision of each effect."""

from thermal_robot.planning.plan import Expected, ExpectedParameter, Plan, plan, text, write_plan

__all__ = ["Expected", "ExpectedParameter", "Plan", "plan", "text", "write_plan"]
