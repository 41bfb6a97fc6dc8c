"""Every number that was chosen to say what an error may follow: its value, its unit, and why that one."""

READS_TO: dict[str, tuple[float, float]] = {
    "rad": (1e-4, 2e-3),
    "m": (1e-4, 1e-3),
    "rad/s": (1e-3, 1e-2),
    "m/s": (1e-3, 1e-2),
    "rad/s²": (1e-2, 1e-1),
    "m/s²": (1e-2, 1e-1),
    "°C": (0.05, 0.5),
    "N·m": (0.05, 1.0),
    "N": (0.05, 1.0),
}
"""By unit, how fine and how coarse the instruments are that read such a quantity. Joints: no servo stands stiller than
0.1 mrad, however many digits its encoder has, and no encoder is coarser than 12 bits a turn. Temperature: sensors and
the place where they sit are good to 0.05 K at best; the coarsest in use count in halves of a degree. Torque: motor
currents tell 0.05 N·m in a small arm, 1 N·m in a large one."""
GRAVITY_READS_TO = 5e-3
"""Of gravity's direction: a load that shifts by less moves an arm that bends by 2 mm no more than 10 µm."""
TWIN = 0.01
"""Of the spread of a quantity: another reading of it that differs by less is its twin."""
