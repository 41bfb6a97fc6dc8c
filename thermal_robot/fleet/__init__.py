"""More than one campaign: many robots at once."""
