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
"""Standard errors from which on a fault of a log, or a change between two, is told: one in 400 by chance."""
LEAST_AGAINST = -0.5
"""Slope of recorded over needed torque below which the sign is the other one: nearer to −1 than to 0."""
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
QUARTERS = 4
"""Parts of a motion whose lags tell the standard error of its own: of a scatter by four the error is 41 %, by three a
half; and a part of the shortest motion still has half a second, five lags of a servo."""
OUTLIER = 5.0
"""Robust standard deviations from the other motions' lags from which on a motion's stamps are shifted: of thousands of
motions none by chance."""

STIFFNESS = 1.0 / 0.07
"""N·m/rad: of a servo whose gain nobody states, from a hobby servo's logs (0.07 rad/(N·m))."""
TORQUE_LIMIT = 3.0
"""N·m: of a servo of which nobody states it, that of a hobby servo's data sheet."""
STEP = 4e-3
"""s: longest time step, a tenth of the shortest lag that is found."""
STEP_ALONE = 5.5e-3
"""s: longest time step of joints that go their own ways, whose servos nobody states: a tenth of a hobby servo's lag. Of
an SO-101 paths then err by 0.8 to 1.6 mrad rms, and in steps of 4 ms by as much but a seventh; 4 to 8 stay unexplained.
"""
DIFFERENCE, COARSE = 0.05, 0.5
"""Of an expected size: step of the finite differences, small beside it and large beside rounding of a stuck joint; and
of a stiffness and a delay: less tells but which slip comes a moment later, and which step of the simulation a command
falls into."""
CLUSTERS = 8
"""Motions from which they count as independent: fewer give no standard error worth the name. Fewer are cut into pieces
until there are so many, and ± is said to be weak. No more: errors hang together within a motion, and the shorter the
pieces, the less of that is seen."""
ROUNDS = 12
"""Gauss-Newton steps at most of one fit."""
SETTLED = 3e-4
"""Of the sum of squares: a smaller gain ends the fit. It is half a nat of what is worth 3000 independent readings."""
DAMPINGS = (0.0, 1e-2, 1e-1, 1.0, 10.0)
"""Of the information, added to a step (Marquardt): the first that betters the fit is taken."""
SHIFTS = (-1.0, 1.0, -0.25, 0.25)
"""Of a delay's expected size, 10 ms, by which delays are tried earlier and later at the end of a fit."""
LEAST_NOISE = 1e-5
"""rad: no encoder of a joint is finer; a simulated log may leave nothing."""
WIDE = 10.0
"""Times the expected size: prior of the least-squares values that the deflation keeps; it bounds the unseen."""
SEEN = 1e-5
"""Squared length of a column at its expected size, in units of the noise, below which the data do not see it."""
PAYLOAD = 0.3
"""Expected payload over the rated one: the mass that the weakest joint can hold with the arm stretched as it moved."""
SOFTER = 20.0
"""Factor by which a servo is at most softer or stiffer than stated: a softer one does not hold its arm, and the droop
of a stiffer one cannot be seen."""
PLANE_FRICTION = 0.3
"""Expected coefficient of friction of a tool on a table: plastics and rubber on wood and metal have 0.2 to 0.5."""
SELF_LOCKING = 2.0
"""Largest friction of a gear over its load: a train that passes on a third of what drives it; from 1 on it locks."""
PRESSED = 3
"""Rounds in which a plane's force is found: the first where the tool would be without it, and without its friction."""
LEAST_SPRING = 0.1
"""Of the compliance of all joints and a plane, what a joint sees beside its own at least: a rigid plane would ring."""
FLEX = 1e-3
"""m/N: expected compliance of a plane and of links beyond the encoders, of a printed arm of 0.3 m; metal has less."""
FEW = 0.999
"""Quantile of the tracking error from which a saturation is looked for."""
SCAN = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Times the expected size at which a torque limit is looked for first: from 0.8 rad of error to 25 mrad."""
REFRESHES = 2
"""Times that loads are taken anew where the joints go, and plain servos fitted: a third moves a residual by 1 %."""
ODDS = 9.0
"""Against nothing in its place, from which an effect is kept: nine to one, as for poses."""
AT_ONCE = (32, 16, 8, 4, 2)
"""Parameters of a group of joints that elimination drops at once, if linear problem and evidence agree: plain servos
of seven joints that move each other have about fifty."""
RIVALS = 2
"""Effects that are fitted in the place of each that is chosen, and beside those of each joint: the likeliest of the
linear problem, which orders what is near and not what is far."""
ALIKE = 0.75
"""Squared partial correlation from which an effect is fitted in another's place, however much that explains: it leaves
less than half of its amplitude."""
MOVES = 12
"""Exchanges and additions at most among exact fits, each of which betters the evidence."""
FAR_BELOW = 20.0
"""Log evidence below the choice's from which a set is no rival, and not fitted if so predicted (linear problem): all of
them together weigh less than a millionth."""
GATE = 3.0
"""Times what the other kinds of motion leave: of a kind that leaves more, no verdict is given."""
FOLDS = 5
"""Parts of the motions that are held out in turn."""
BOOTSTRAPS, BOOTSTRAP_SEED = 400, 7
"""Draws of motions that tell the interval of a shrinkage; the same log always gets the same answer."""
VISIBLE = 2.0
"""Times the encoder's noise: an effect that moves its joint by less is not shown, since nobody could see it go."""
NOISY = 1.5
"""Times the encoder's noise: what remains below it is that noise."""
STRUCTURE, LEVELS = 0.1, 10
"""Share of what remains that a curve must explain in motions held out to be told; and levels of such a curve."""
MOST_PAYLOAD = 100.0
"""kg: where no joint feels a payload."""
SMOOTHED, KEPT = 0.2, 20
"""s: window of the local cubics that differentiate positions, and rows kept of each: they pass 6 Hz, what an arm
accelerates with, and not its lowest resonances, 8 to 30 Hz, which no rigid body has."""
PRANDTL = 4e-3
"""rad over which a joint's friction builds up, from end to end, when it turns back: what public logs of arms show."""
LINK = 0.3
"""m: length of a link, of which a tenth is how far its centre of mass may be off."""
SAME_LINK = 1e-3
"""Of the largest number of a link: by no more may those of two robot files differ, which round to four digits."""
AGREE = 0.1
"""Share by which the shrinkage of a simulator's own rollout may differ from the one that was told."""
STICKING = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""MuJoCo's impedance of friction that is written: at its usual 0.9 a joint that should stick creeps to its place within
a second; here a thousand times more slowly."""
STIFFEST = 2.0
"""Time steps: shortest time constant that MuJoCo lets a constraint have."""
WAVES = 10
"""Rounds at most in which an arm's reference motion is taken anew: it comes to rest within three or four, but for what
is far from its commands."""
TIME_STEP = 1e-3
"""s: expected time step of a simulator that made a log; MuJoCo's is 2 ms unless somebody changes it."""
CREEP, SOFTEST = 0.1, 0.9
"""Expected and largest share of what pulls at a joint that a simulator's friction does not hold: MuJoCo's is 0.1 unless
somebody changes it, and with 0.9 friction would be none."""
TOGETHER = 4
"""Sets of parameters that a thread simulates at once: of fifty motions their paths take 30 MB."""
MOST = 0.5
"""Share of a gap's mean square: effects that explain less than what stays unexplained are not told."""
