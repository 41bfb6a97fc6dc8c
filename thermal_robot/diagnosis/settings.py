"""Chosen numbers of the diagnosis: verdict, drawing of effects, next measurement; each with its unit and reason."""

LEAST_LEADING, MOST_LEADING = 1e-3, 4
"""Probability below which an explanation is left out of the design of samples, and largest number of explanations."""
DECIDED, WORTHWHILE = 0.9, 1.0
"""Probability from which an explanation is decided where further samples would bring less than so many nats for any
rival; it caps that of one whose correction harms rows held out by session or region."""
BEYOND = 5.0
"""Offset outside the campaign's temperatures, K: a hall on another day."""
LOOSE = 0.1
"""Prior standard deviation of a frame, m and rad, where the data leave it open."""
FOLD_FRAMES = 5e-3
"""Prior standard deviation, m and rad, of how far a fold's frames are from those of all rows. A direction that is
nearly free moves decimetres, where a linear problem predicts nothing; at a metre this bends by 25 µm."""
TIE = 1e-3
"""Weight of the information on parameters beside that on explanations, when samples are proposed: it breaks ties."""
LOAD, PAYS = 2.0, 1.3
"""Payload, kg, that nearly every arm carries, offered where none was recorded; ratio to the gain of poses without it:
less is not worth a second set-up."""
WRONG_SIDE, INSISTS, LEAVES_LESS = 3.0, 7.0, 0.95
"""Standard deviations from which a parameter tells its sign; log evidence, 1 in 1000, that reversing a quantity must
gain; and largest ratio of the noise with and without the reversal: beside a tenth of the remainder's mean square,
errors that no effect has may decide the sign of a small one."""
PRIOR_FACTOR, COMPARED = 3.0, 8
"""Factor of all prior sizes, down and up, in the sensitivity of the verdict; and number of explanations compared."""
MATERIAL_PLACE, MOST_PLACES = 0.03, 8
"""Smallest share of an effect's contribution with which a place is drawn; and largest number of such places."""
LINE_POINTS, ROUGH, DENSE_POINTS, ROWS_A_POINT = 25, 0.01, 400, 10
"""Points of a drawn law; of its range, the roughness below which it follows one quantity alone, its points then, and
rows that a point stands for otherwise, and that are taken together to ask whether an error follows a quantity."""
MOST_MOVED, LIKELY, ORDINARY = 2, 0.5, (1.0, 3.0)
"""Largest number of zeros and links that move in one crash, as an arm stops at the first contact; probability from
which one is named: more probable than not; and largest zeros and placements without a crash, in expected sizes: 1 mrad,
which mastering with a gauge leaves, and 1.5 mm, what a light arm shows that nobody calibrated."""
CALM, STRUCK = 0.3, 10.0
"""Initial prior scales, in expected sizes, of an arm's ordinary errors, and of what a crash moved, 10 mrad and 5 mm;
the most probable ones are found from there."""
UNSETTLED = 1.5
"""Ratio of the exact model's residual to the linear one's from which they are different models. They agree to a
thousandth where errors are those of robots."""
LEAST_SEEN = 1e-4
"""Eigenvalue floor of the frames, of the largest: a direction that the rows tell to a hundredth of the strongest takes
nothing over, as it would move far rows a hundred times as much."""

# --- updates with new rows ---

WIDE = 2.0
"""Distance from the median, in root mean squares of the rows' moves, from which rows are summed: of the few that move
further, as many cross it one way as the other."""
KEPT = 500
"""Rows that are kept one by one, more where more are in the tail; up to twice as many before sums are formed anew. A
fit of a thousand rows takes some tens of milliseconds, and a thousand rows hold the median well inside those kept. As
many stand for all where it is asked how firmly rows hold the parameters, and how far they are from linear."""
AT_REST, REST_ROUNDS = 1e-9, 60
"""Convergence limits of the fixed-point iteration: parameters in deviations, noise and scales by share; rounds at most.
A thousandth of what is promised; each round is about ten times nearer."""
CURVED = 5e-6
"""Largest bias of a parameter, in deviations, by the curvature of the summed rows before they are linearised anew. A
diagnosis itself ends its rounds about 1e-5 deviations from where they would come to rest."""
FALLS = 1e-3 / 5.0
"""Level of one test of the choice: new rows of the same robot and the same noise reject it once in a thousand updates,
a chance that five tests share."""
FEWEST_OUTSIDE, OUTSIDE = 3, 0.05
"""Number, and share, of new rows beyond the measured range from which the choice is to be made anew: a model of effects
that were told apart inside says little of those that show outside alone."""
RUNNERS, LEAST_RIVAL = 8, 1e-3
"""Number of alternative combinations compared by the new rows, and their least probability against the chosen one: one
of a thousandth needs rows that say as much as a deviation of 3.7 before it is the better one."""
MOST_LEAD = 20.0
"""Largest log odds of a rival that are reported, 5e8 : 1."""
