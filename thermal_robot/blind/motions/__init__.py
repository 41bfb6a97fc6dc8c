"""The blind trial of motions: arms and faults in MuJoCo, whose logs are diagnosed and judged."""
