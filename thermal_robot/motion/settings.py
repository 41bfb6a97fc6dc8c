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
CLEAR = 3.0
"""Standard errors from which on a fault is told: one log in 400 by chance."""
FEWEST_CLUSTERS = 8
"""Motions below which each is parted for the scatter between them: fewer give no standard error worth the name."""
WINDOW = 1.0
"""s over which position and the integral of velocity are compared: a velocity's filter of 50 ms takes 0.2 % there, and
2 % over a tenth of it."""
OTHER_UNIT = 0.05
"""Relative difference from which on a scale is another unit: makers round the scale of a velocity to 1 %, and gears do
not err by more."""
OTHER_GAIN = 1.5
"""Factor by which a measured move differs from its command in another unit: friction and load take a third of a small
move at most, and resonance adds less than half."""
FOLLOWS = 0.7
"""Share of a move's square that its command must explain before it tells a scale or a clock."""
FROZEN = 0.1
"""rad or m over which a command, averaged over the longest lag, passes by a reading that stays the same to the last
digit: friction holds a joint over a fifth of that in hobby servos, and a stop on one side only."""
LIKE = 0.5
"""Correlation of position with the integral of velocity from which on both are of one servo: exchanged ones come to
0.2, right ones to 0.98."""
STIRRED = 1e-3
"""rad or m rms within :data:`STRIDE` from which on a joint's moves tell whose command they follow: a count of 4096."""
UNEQUAL = 0.1
"""Scatter of a clock's steps over their median from which on stamps jitter: less moves nothing by a count."""
RATES = 0.05
"""Relative difference of two clocks that is looked for beside that of their lengths: a loop that runs at 48 Hz for 50,
a camera at 29.97 for 30."""
PIECE = 10.0
"""s of a motion that has one lag: clocks that differ by 1 % drift by a servo's lag within it."""
FAR = 2
"""Samples by which stamps must be shifted to be told: one is what reading after writing costs."""
OUTLIER = 5.0
"""Robust standard deviations from the other motions' lags from which on a motion's stamps are shifted: of thousands of
motions none by chance."""
