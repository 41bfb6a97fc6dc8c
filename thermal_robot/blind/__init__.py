"""Blind trial: diagnosis of simulated robots with hidden faults, scored against the truth."""
