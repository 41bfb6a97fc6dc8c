"""Ledger of Kluz and Trzepieciński (2018): the paper's printed numbers beside recomputed ones."""

from thermal_robot.paper.entry import VERDICTS, Entry
from thermal_robot.paper.inputs import PaperInputs, rv_m2_with_hand
from thermal_robot.paper.ledger import Ledger, ledger

__all__ = ["VERDICTS", "Entry", "Ledger", "PaperInputs", "ledger", "rv_m2_with_hand"]
