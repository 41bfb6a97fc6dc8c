"""Chosen numbers of the trial of motions, each with its unit and reason."""

from __future__ import annotations

JOINTS = (2, 7)
"""Number of joints of an arm: from a pan and tilt to a redundant arm."""
LENGTH = (0.08, 0.3)
"""Length of a link, m: of hobby arms and of cobots."""
MASS = (0.1, 1.0)
"""Mass of a link, kg, with its motor."""
RADIUS = (0.03, 0.08)
"""Radius of a link, m, which is a cylinder; its centre of mass lies beside its axis by up to that in x and in y."""
DROOP = (0.01, 0.06)
"""Deflection of a servo by gravity, rad, when the arm is stretched: cobots and hobby servos."""
LAG = (0.02, 0.08)
"""Time constant of a servo, s: damping over stiffness."""
LIMIT = (3.0, 8.0)
"""Torque limit over gravity's torque when the arm is stretched."""
BITS = (12, 16)
"""Resolution of an encoder, bits: 4096 counts a turn of hobby servos, 65536 of others."""
RATES = (50.0, 100.0)
"""Sampling rate of command and encoder, Hz."""
STEPS = (0.5e-3, 1e-3, 2e-3)
"""Time step of MuJoCo, s."""
STIFF = 1.0
"""Step times damping over inertia up to which an explicit step of fourth order errs by a percent; else implicit."""
SECONDS, SETTLE = 6.0, 1.0
"""Duration of a motion, s, and of the rest before it: more than ten lags."""
CENTRE, REACH = 0.8, 0.8
"""Centre of a motion, rad, either side of an arm that points up, and its largest amplitude."""
SPEED = (0.3, 2.0)
"""Speed of commands, rad/s."""
SPREAD = 0.5
"""Standard deviation of the logarithm of a fault's size."""
VISIBLE = 1.0
"""Smallest rms displacement, encoder counts, of the joint that a fault moves most; less is drawn anew."""
DRAWS = 6
"""Largest number of draws of a fault's size, half as large again each time, until it can be seen."""
FRICTION = 0.3
"""Friction coefficient of the tool on the table: of plastics and metals, sliding."""
ABOVE = (0.03, 0.15)
"""Share of the readings at which the tool would be below the table."""
BEYOND = (0.02, 0.15)
"""Share of the readings that lie beyond an end stop, or that ask for more than the torque limit."""
SHARE = {
    "coulomb": 0.02,
    "armature": 5e-3,
    "ripple": 0.02,
    "uneven friction": 0.02,
}
"""Usual size over the torque limit: friction, N·m, and ripple, N·m (issue 40's table); inertia, kg·m²."""
USUAL = {
    "delay": 20e-3,
    "payload": 0.3,
    "viscous": 0.3,
    "kp": 0.2,
    "zero": 20e-3,
    "gain": 20e-3,
    "dead zone": 5e-3,
    "spring": 0.1,
}
"""Usual size: s; of the payload that the weakest joint holds; of the servo's damping; of its stiffness; rad; –; rad; of
the stiffness."""
RIPPLES = (6, 20)
"""Cycles a turn of a torque ripple: teeth of a gear, poles of a motor."""
