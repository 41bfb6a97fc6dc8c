"""Data that grow: new rows added to a diagnosis, whose choice of effects is held while they agree with it."""
