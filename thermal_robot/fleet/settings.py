"""Chosen numbers of comparison, wear and fleets, each with its unit and reason."""

from __future__ import annotations

MAY_BE = 0.1
"""Probability from which an effect that was not found is compared, for what each campaign is too short to tell several
may, and held beside another whose parameters are told. With 40 arms that warm by less than can be found in half of
them, a joint's zero was off by 4.5 of its deviations over the fleet without this, by 3.4 at 0.3, by less than 3 at 0.1;
below that deviations grow, and nothing gets better."""
SEEN = 1.0 - 1e-6
"""Share of a parameter's direction that the data must see for it to have a value: all but rounding."""

CHANGED = 0.8
"""Prior probability that an effect of a robot changed somewhere between campaigns: who compares has a reason to,
and what chance alone does is kept away by :data:`FALSE_CHANGE`."""
EVERYWHERE = 0.05
"""Part of the changes of an effect that are in all its places at once, as a new mastering of all joints is; a
collision, wear or a repair are in one."""
CHANGE_SPREAD = 2.0
"""Standard deviation of the logarithm of the size of a change, about that of the effect: a part of it, seldom more, and
nobody knows which; 95 % within a factor of fifty."""
FALSE_CHANGE = 0.02
"""Chance, all that was looked at counted, that two campaigns of a robot that did not change show any change."""
FEW = 5
"""Campaigns up to which every set of them may differ from the others (30 sets of five); of more, each alone, and those
before or after any moment."""
AT_ONCE = 500
"""Parts that are weighed together, each beside all others, and to first order at a time: a search over so many takes
seconds and a hundred megabytes; four campaigns of a real robot have 2800."""
AGREE = 0.5
"""Part of the larger of two sizes by which they may differ and still be one effect that changed, not two names for
something else: wear and re-adjustment move a size by a part of it, a wrong name takes any size."""
MOST = 0.5
"""Part of an effect's strength on which campaigns must agree for it to keep its name."""
HELD = 1e9
"""Degrees of freedom of the noise in a joint fit: each campaign has told its own, in units of which all is."""
TOLD = 1.0
"""Deviation, in expected sizes, from which a parameter is not compared: the data say no more than its size."""
DISTINCT = 1e-3
"""Part of a parameter's column that must be left beside the parameters before it; less is the same thing twice."""
TWICE = 2.0
"""Stated deviations by which predictions of two campaigns may differ: beyond that the model is wrong, not the noise
(the cross-validation of mrcal)."""
POSES = 400
"""At most, of each campaign, at which predictions are compared: their root mean square is known to 4 %."""
SAME_PLACE = 1e-6
"""m and rad: two descriptions of one robot put its tool to the same place but for what a file rounds."""
TRIED = 8
"""Configurations at which two descriptions are compared: two robots that differ anywhere differ there."""
SAYS = 0.01
"""What a model's rows must say of a direction of its parameters, against what was expected beforehand, to count: frames
are held so loosely that of a zero which they take up a thousandth is left, and a hundredth tells nothing."""
ROUNDING = 1e-9
"""Part of the longest column below which one is rounding: a joint that turns the target about itself moves it by
1e-16 m, and a parameter that does anything at all by a millionth of another's."""

FEWEST = 3
"""Campaigns. Two tell that something changed, not whether at once or bit by bit."""
WIDE = 30.0
"""Prior deviation of what a parameter is throughout, in expected sizes: it holds what no campaign determines, and takes
next to nothing from what one does, so that only changes are weighed."""
ANY_CHANGE = 0.2
"""Prior probability that anything moves in a series, however many parameters are followed: the more there are, the less
likely is each. Robots are measured anew where somebody suspects a change, and mostly nothing has."""
KINDS = {"jump": 0.4, "trend": 0.4, "walk": 0.2}
"""Share of each kind among what moves. Jumps (collisions, new zeros) and trends (wear) are what is known to happen;
what wanders without a direction is rarer (a loose fixture, temperature that nobody recorded)."""
SCALES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Prior deviation of a change in expected sizes of its parameter, each as likely: what has been corrected moves by less
than the robot was off at first, and a collision by more."""
SCATTER = (1.0, 1.12, 1.25, 1.4, 1.6, 2.0, 2.5, 3.2, 4.0, 6.0, 10.0)
"""How much more campaigns scatter about each other than their deviations say: what is named nowhere shifts each
campaign by another amount, as each measures other poses."""
SCATTER_SPREAD = 0.3
"""Prior deviation of the logarithm of that factor, above 1 alone: deviations are mostly right within a third."""
SCATTER_TOLD = 1.3
"""Factor of scatter from which on a reader is told: by chance it is above in one series of thousands."""
BEAM = 10
"""Explanations that are carried on from one number of moving parameters to the next."""
MOST_MOVING = 6
"""Parameters at once: what moves more of them is another robot, or another model."""
NEGLIGIBLE = 12.0
"""Natural logarithm of odds: explanations less likely than the best by this are not carried on."""
SUBSTITUTE = 0.95
"""Correlation of the changes of two parameters, frames and constants taken off, above which the data cannot tell them
apart: to name the right one takes more than three times the change that it takes to see it."""
COMPARABLE = 0.3
"""Share of its prior deviation (one expected size) below which a change of a parameter must be known for it to be
compared at all; otherwise unknown frames, or the poses, hide it."""
FALSE_ALARM = 0.01
"""Probability that a series without any change rings at all: one in a hundred, as on a control chart of three sigma
with a few points."""
LINEARISATIONS = 3
"""About the common model. Errors are of mrad, so that each leaves a thousandth of the one before."""
CROSSING = 1.959963984540054
"""Deviations of a two-sided interval of 95 %."""
HIDDEN = 1e-6
"""Share of a move's information that is left beside others, below which nothing can be told of it: its square is then
three digits above the rounding of the sums."""
LIKELY = 0.5
"""Probability from which on a parameter that does not ring is named beside those that do."""

UNHELD = 1e4
"""Prior deviation, in expected sizes, of an effect whose parameters are to be told by the data alone: next to none,
while the equations can still be solved."""
ROWS_AT_ONCE = 4096
"""Rows of the table that are held at a time: some 200 campaigns, a few MB."""
WRITTEN_EVERY = 1.0
"""Seconds within which what is done is on disk: a power cut costs no more, and a disk has one write to do."""
WAIT_FOR_OTHERS = 1.0
"""Seconds that a second run waits for the folder of a first one before it is refused."""
TIME_LIMIT = 3600.0
"""Seconds that one campaign may take: one of 12 000 poses takes four minutes; what takes longer hangs."""
ANSWERS_WITHIN = 30.0
"""Seconds within which a scheduler must answer: it may be busy, but it is there."""
ASKED_EVERY = 2.0
"""Seconds after which a scheduler is asked again how many threads it has: workers come within minutes, and go."""
SPREADS = (0.02, 5.0)
"""Smallest and largest spread between robots that are tried, in units of the scatter of what was measured of them; zero
is tried, too. Below the first it cannot be told from none; beyond the last the scatter would have to be a chance."""
GRID = 24
"""Spreads that are tried between these: neighbours differ by a quarter, less than a fleet of ten can tell."""
ROUNDS = 15
"""Of expectation and maximisation: means then move by less than a hundredth of their deviations."""
UNLIKE = 0.05
"""Share of robots unlike the others with which the rounds begin."""
UNLIKE_WIDTH = 5.0
"""How much wider robots unlike the others scatter, by the half width of Cauchy's law: a fault is some times what is
usual, and may be any times."""
UNLIKE_PRIOR = (0.5, 20.0)
"""What is known of their share beforehand, in robots unlike and like: rare, and learned from a fleet of twenty."""
LEAST_HEARD = 1e-6
"""Weight of a robot that is surely unlike the others: of a group in which all are unlike each other there is a mean."""
MOST_LISTED = 500
"""Robots that a list of the summary names: a page that can still be read; the table has all."""
MOST_GROUPS = 12
"""Groups of a label that are told of a parameter, the most different first."""
FEWEST_ROBOTS = 5
"""Robots of which a mean and a spread can be told: of fewer, their values say as much."""
FEWEST_IN_GROUP = 3
"""Robots of a group that is compared with others: two cannot tell which of them is unusual."""
STRIKING = 0.01
"""P value, all that was looked at counted, below which something is told: one false word in a hundred fleets."""
NAMED = 0.9
"""Probability of being unlike the others from which a robot is named."""
