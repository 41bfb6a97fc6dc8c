"""Every number that was chosen for data that grow."""

KEPT = 500
"""Rows that are kept one by one, more where more are in the tail; up to twice as many before sums are formed anew. A
fit of a thousand rows takes some tens of milliseconds, and a thousand rows hold the median well inside those kept."""
SETTLED, STEPS = 1e-9, 60
"""Deviations by which parameters, and share by which noise and scales, still move when they are found; rounds at most.
A thousandth of what is promised; each round is about ten times nearer."""
CURVED = 5e-6
"""Deviations by which the curvature of the rows in the sums may move a parameter before they are linearised anew. A
diagnosis itself ends its rounds about 1e-5 deviations from where they would come to rest."""
SAMPLED = 500
"""Rows that stand for all where it is asked how firmly they hold the parameters, and how far they are from linear."""
LEVEL, TESTS = 1e-3, 5
"""Chance that new rows of the same robot and the same noise make the choice fall in one update, and among how many
tests it is shared: of these rows, of all since the diagnosis, of a change, of gross errors, of rows outside."""
RIVALS, LEAST_RIVAL = 8, 1e-3
"""Combinations that are weighed again with the new rows, and their least probability against the chosen one: one of a
thousandth needs rows that say as much as a deviation of 3.7 before it is the better one."""
FEWEST_OUTSIDE, OUTSIDE = 3, 0.05
"""Rows, and share of the new rows, beyond what was measured from which on the choice is to be made anew: a model of
effects that were told apart inside says little of those that show outside alone."""
AT_A_TIME = 4096
"""Rows whose columns are held at a time: 4096 of a hundred columns are 10 MB."""
FRAME = 1.0
"""m and rad: what a frame that nothing determines may move by. It only keeps a matrix positive."""
WIDE = 2.0
"""Root mean squares of the rows' moves by which rows stand off the median that are not kept one by one: of the few that
move further, as many cross it one way as the other."""
QUIET = 0.9
"""Of the slack of a stated noise: where less remains, the median of what rows leave bears on nothing."""
SAME_PLACE = 1e-9
"""m: by which the tool frame differs between readings of one URDF at most."""
LEAD = 0.0
"""Log odds of another combination against the chosen one from which on the choice is to be made anew: a fresh diagnosis
takes the more probable one, however little it is ahead."""
MOST_LEAD = 20.0
"""Log odds that are told at most: beyond 5e8 : 1 nobody asks how many."""
