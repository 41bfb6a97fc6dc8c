"""Assembly by a robot (Kluz et al. 2018): repeatability, thermal shift, probability of joining, workspace maps."""
