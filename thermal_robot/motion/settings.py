"""Numbers of the motion room that somebody chose, each with its unit and its reason."""

from __future__ import annotations

LEAST_RATE = 28.0
"""Hz: 30 Hz as cameras and their logs understand it (29.97), with some late rows. A servo's lag of 50 to 100 ms needs
two samples."""
LONGEST_GAP = 0.5
"""s without an encoder reading that interrupt a motion: five lags of a servo, after which nothing of its state before
is left in what is simulated from the command."""
FEWEST_SAMPLES = 60
"""Samples of a motion: two seconds at the least rate; what is shorter tells no lag."""
STRIDE = 0.1
"""s over which moves are taken: an encoder of 4096 counts a turn then resolves 0.015 rad/s, and no servo's lag is much
shorter."""
LONGEST_LAG = 1.0
"""s within which a measured move must follow its command: ten lags of a slow servo."""
STILL_COMMAND = 1e-4
"""rad or m within :data:`STRIDE` that a command in rest moves at most: rounding of what was logged in degrees."""
FOREIGN = 0.5
"""Share of the square of the moves that comes while no command moves, from which on a motion counts as guided by an
external force: an arm that falls back into a stiff joint leaves 0.01, one that is led by hand 1."""
NO_LAG = 2e-3
"""s: a position servo lags by its damping over its stiffness, 50 to 100 ms in hobby servos and 10 ms in the stiffest
simulated ones; a controller that lags by less knows the velocity beforehand."""
