"""Chosen numbers of the effects, each with its unit and reason."""

from thermal_robot.campaign.settings import STILL

KEPT = 4
"""Effects whose parameters are kept for the next who asks, those asked for last: the settings of an effect in single
places come one after another, and the responses of all effects would fill the memory."""
READS_TO: dict[str, tuple[float, float]] = {
    "rad": (STILL, 2e-3),
    "m": (STILL, 1e-3),
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
SIZE_MOST = 50.0
"""Times its expected size, that one sigma of an effect or a law is at most. Lost motion of a worn wrist (9 mrad), the
zeros of servo arms and the torso of a service robot (45 mrad) are 30 to 45 times those of an industrial arm. What is
larger is another model, or an alias of the frames that stretches."""
FADES = 0.1
"""Of the range in which a curve was found: so far beyond it e^−½ of what it differs by from its mean is left. One with
five knots turns within a quarter of its range: so far away nothing of it is known."""
BESIDE = 0.02
"""Of the range that was measured: a row that leaves it by less is not called outside. A hundred rows of a range leave a
hundredth of it open at either end, and the next one of them falls there now and then."""
IN_MODEL = 20.0
"""Times of its expected size that a frame is off where it was set on purpose: a tool is some centimetres long, where
errors are of a millimetre."""
