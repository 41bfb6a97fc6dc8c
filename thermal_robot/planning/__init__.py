"""The first campaign, before anything was measured: what to command, and how well each effect will be known."""

from thermal_robot.planning.plan import Expected, ExpectedParameter, Plan, plan, text, write_plan

__all__ = ["Expected", "ExpectedParameter", "Plan", "plan", "text", "write_plan"]
