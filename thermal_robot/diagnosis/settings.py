"""Chosen numbers of the diagnosis: verdict, drawing of effects, next measurement; each with its unit and reason."""

LEAST_LEADING, MOST_LEADING = 1e-3, 4
"""Probability below which no explanation is worth a measurement, and how many explanations are told apart."""
DECIDED, WORTHWHILE = 0.9, 1.0
"""An explanation so probable is decided where further samples would bring less than so many nats for any rival; none is
told as more probable whose correction harms rows held out by session or region."""
BEYOND = 5.0
"""K outside the campaign's temperatures: a hall on another day."""
LOOSE = 0.1
"""m and rad: where the data leave a frame open, it is somewhere there."""
TIE = 1e-3
"""Weight of the information on parameters beside that on explanations, when samples are proposed: it breaks ties."""
LOAD, PAYS = 2.0, 1.3
"""kg that nearly every arm carries, offered where no payload was recorded; times what poses without it tell: less is
not worth a second set-up."""
WRONG_SIDE, INSISTS, LEAVES_LESS = 3.0, 7.0, 0.95
"""Standard deviations from which a parameter tells its side; the natural logarithm, 1 in 1000, by which an explanation
with a quantity turned round must be more probable than any without; and what it may leave of what those leave: beside a
tenth of the remainder's mean square, errors that no effect has may decide the sign of a small one."""
PRIOR_FACTOR, COMPARED = 3.0, 8
"""Factor of all prior sizes, down and up, under which the verdict is weighed again, and among how many explanations."""
MATERIAL_PLACE, MOST_PLACES = 0.03, 8
"""Of an effect's work: a place with less is not drawn; and how many are."""
LINE_POINTS, ROUGH, DENSE_POINTS, ROWS_A_POINT = 25, 0.01, 400, 10
"""Points of a drawn law; of its range, the roughness below which it follows one quantity alone, its points then, and
rows that a point stands for otherwise, and that are taken together to ask whether an error follows a quantity."""
MOST_MOVED, LIKELY, ORDINARY = 2, 0.5, (1.0, 3.0)
"""Zeros and links that are taken to move in one crash at most, as an arm stops at the first contact; the probability
above which one is named: more probable than not; and times the expected sizes that zeros and placements without a crash
are at most: 1 mrad, which mastering with a gauge leaves, and 1.5 mm, what a light arm shows that nobody calibrated."""
CALM, STRUCK = 0.3, 10.0
"""Times the expected sizes at which scales are first taken: of an arm's ordinary errors, and of what a crash moved, 10
mrad and 5 mm; the most probable ones are found from there."""
UNSETTLED = 1.5
"""Times what the linear model leaves: an exact one that leaves more is another model. They agree to a thousandth where
errors are those of robots."""
LEAST_SEEN = 1e-4
"""Of the strongest direction of the frames, squared: one that the rows tell to a hundredth of that takes nothing over,
as it would move far rows a hundred times as much."""

# --- updates with new rows ---

WIDE = 2.0
"""Root mean squares of the rows' moves by which rows stand off the median that are not kept one by one: of the few that
move further, as many cross it one way as the other."""
KEPT = 500
"""Rows that are kept one by one, more where more are in the tail; up to twice as many before sums are formed anew. A
fit of a thousand rows takes some tens of milliseconds, and a thousand rows hold the median well inside those kept. As
many stand for all where it is asked how firmly rows hold the parameters, and how far they are from linear."""
AT_REST, REST_ROUNDS = 1e-9, 60
"""Deviations by which parameters, and share by which noise and scales, still move when they are found; rounds at most.
A thousandth of what is promised; each round is about ten times nearer."""
CURVED = 5e-6
"""Deviations by which the curvature of the rows in the sums may move a parameter before they are linearised anew. A
diagnosis itself ends its rounds about 1e-5 deviations from where they would come to rest."""
FALLS = 1e-3 / 5.0
"""p-value of one test below which the choice falls: new rows of the same robot and the same noise make it fall once in
a thousand updates, a chance that five tests share."""
FEWEST_OUTSIDE, OUTSIDE = 3, 0.05
"""Rows, and share of the new rows, beyond what was measured from which on the choice is to be made anew: a model of
effects that were told apart inside says little of those that show outside alone."""
RUNNERS, LEAST_RIVAL = 8, 1e-3
"""Combinations that are weighed again with the new rows, and their least probability against the chosen one: one of a
thousandth needs rows that say as much as a deviation of 3.7 before it is the better one."""
MOST_LEAD = 20.0
"""Log odds that are told at most: beyond 5e8 : 1 nobody asks how many."""
