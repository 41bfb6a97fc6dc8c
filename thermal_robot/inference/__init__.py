"""Frames, columns, evidence, exact fit: from observations to an explanation."""
