"""The paper's chain, no data needed: repeatability, thermal shift, probability of joining, maps of the workspace."""
