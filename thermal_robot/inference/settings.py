"""Chosen numbers of inference and findings, each with its unit and reason.

Numbers of a single effect are in its own file.
"""

import numpy as np

# --- what is believed before the data ---

PRIOR_PROBABILITY = 1.0 / 6.0
"""That an effect is at work, random ones too: two or three of sixteen; a probe named 2 to 5 on nine real robots."""
COARSENESS = 1.0
"""Standard deviation of ln κ, the factor that all expected sizes of one robot share: an arm three times as coarse as
catalogues say in one respect is so in the others, as servo arms and series elastic ones are, and fine arms are fine."""
IN_ALL, ONE_MORE = 1.0 / 3.0, 0.5
"""Share of an effect's probability that it is in all its places, and that it is in one; each further one halves it, so
that all shares sum to one."""
LEADING_PLACES = 4
"""Places at most in which an effect is tried together once it was found in all: those that do most, as fitted."""
GIVEN_NOISE_DOF = 20.0
"""Degrees of freedom that a stated noise is worth: it is trusted to about 15 %, as data sheets are."""
NOISE_SLACK = 1.3
"""Times a noise, stated or told by repeats: a remainder above it is no longer that noise (two sigma of those 15 %)."""
MISTRUST = 5.0
"""Largest penalty, natural logarithm, for calling a stated noise wrong: e⁵, about 1 in 150."""
SMOOTH_PRIOR = 0.5
"""That something smooth is at work that no effect and no law accounts for: as likely as not."""
TAUS = tuple(2.0 ** (k / 4) for k in range(-4, 25))
"""Rms of a discrepancy over the noise: below the first it is noise, above the last a mistake. In quarters of an octave:
beside a hundred independent errors a size a factor of two off costs 20 nats."""
TAU_STEPS = (4, 2, 1)
"""Of that grid: steps in which the best size is looked for."""
LENGTHS = (1.4, 2.8)
"""Length scales of the discrepancy at the tool, in standard deviations of the inputs times the root of their number."""
LANDMARKS = 100
"""Rows that stand for all in a discrepancy of very many (Nyström): smooth functions need no more."""
NYSTROM_FLOOR, SMOOTH_FLOOR = 1e-6, 1e-9
"""Of the largest eigenvalue, and of the noise's variance: directions of a discrepancy below are rounding."""
NO_BACKGROUND = ("approach", "torque", "velocity", "acceleration", "order", "time", "temperature")
"""Quantities that drive known effects of a joint, by how their names begin: a function of one is that effect, no
background. Positions and conditions stay, as what nobody listed follows them."""
COSINES = 5
"""Functions of each quantity in the discrepancy of places: with amplitudes 1/k² further ones bring 1 %."""
ERROR_AT_JOINT, ERROR_ELSEWHERE = 3e-4, 1e-4
"""rad, and m and rad: sizes of errors in a joint and in a twist elsewhere, in proportion; those of discovered laws."""
LEVER = 0.3
"""m: a discrepancy of the tool turns it by what moves it over this length."""
STARTS = 3
"""Combinations, the best of those that a search starts from, beside which each kernel of a discrepancy is tried."""
SCATTERING = 3
"""Joints at most that err anew in every pose or visit beside each other."""
PARTS = tuple(2.0 ** (k / 2) for k in range(-3, 4))
"""Rms of a further joint over that of those before it, in halves of an octave."""
KERNEL_REACH = 20.0
"""Log evidence below the best at which a kernel of the discrepancy is given up while a fit iterates."""
AMPLITUDE_REACH = 5.4
"""The same at which an amplitude of one still counts: 1 in 200, four amplitudes an octave."""

# --- rounding ---

ROUNDING = 1e-9
"""m and rad: no table and no robot is more accurate; a smaller step of the frames is their last."""
UNSEEN, ALIAS = 1e-12, 1e-6
"""m and rad: what an expected size moves by less is rounding, as is a smaller distance. Of a column's length: where
less is left of it once others are projected out, it is an exact alias of them; a joint that moves the target by less of
what others do cannot be seen to scatter."""
TINY, BETTER = 1e-300, 1e-9
"""Keeps a quotient of nothing from being infinite; and log evidence, natural logarithm: a smaller difference makes no
explanation better than another."""
SAME_COMMAND = 1e-6
"""rad or m: commands nearer than this repeat each other; controllers print fewer digits."""

# --- rows: which belong together, which are set aside ---

NEAR = 0.01
"""rad, m for a prismatic joint: closer commands repeat a pose, as a tool 1 m out then stays within a centimetre."""
CLOSEST = 1e-7
"""rad or m: where clusters still chain together at this distance, they are the same command."""
LARGEST_CLUSTER = 0.1
"""Of all rows: a larger cluster is a path, not a repeated pose."""
FOLDS = 5
"""Regions of joint space that are held out in turn; of temperature, reach and joints' ranges the outermost fifth is."""
WRITTEN_TO = 1e-5
"""m and rad to which poses of a controller are compared where no noise is stated: screens show a tenth of a millimetre,
topics all digits, and no difference of a model that matters is smaller."""
TURNS_TRIED = 4
"""Turns of the target on the tool from which a fit begins: the next of a cube may be the neighbour of the best."""
FEWEST_STANDS = 3
"""Stands from which on one at a time is held out: of fewer, what is left is another campaign."""
BLOCKS = 20
"""Blocks of consecutive rows that are held out in turn: twenty values tell the spread of a figure to a sixth."""
GROSS_LEVEL = 0.01
"""Chance that noise alone sets any row of a campaign aside."""
GROSS_FACTOR = 1.5
"""Times the squared distance which that chance allows: tails of real instruments are a little heavier than normal."""
BEND_LEVEL = 0.01
"""Share of sound rows that weigh less than fully (Huber's bend)."""
MOST_OUTLIERS = 0.25
"""Of the rows: more are not gross errors but another motion."""
CAUCHY_SCALE = 1.5
"""Times the median distance: the scale of the weights that find the frames, as a third of the rows may be wrong."""
CAUCHY_ROUNDS = 4
"""Rounds of weights and noise in a scan: they settle to a per cent."""
RUN = 3
"""Rows set aside one after another that are a change: of five gross errors in a hundred, three are so once in 170."""
FEW_ASIDE = 0.05
"""Of all rows: fewer that follow each other may be one lapse of the instrument. Without as many, those that speak most
for scatter, the others must still speak for it: of normal scatter they hold a quarter of its variance."""

# --- iterations, and how many rows suffice ---

START_ROWS = 400
"""Rows on which the frames' starts are compared: these frames are then known far better than any start needs."""
START_ROUNDS, START_SETTLED = 200, 1e-5
"""Alternations of base and tool at most, and steps of the frames; the relative change of the median distance at which
alternations end."""
TARGET_STARTS = np.vstack([np.zeros(3), 0.2 * np.eye(3), -0.2 * np.eye(3)])
"""m: where the target may sit on the tool frame; from each the fit reaches 0.3 m."""
SPARE_EQUATIONS = 6
"""Equations that must be left once the frames are fitted: as many as one pose has."""
EVIDENCE_STEPS, EVIDENCE_SETTLED, LEAST_VARIANCE, CLEARLY = 40, 1e-3, 1e-6, 4.0
"""Newton steps of scales, noise and variances at most; the change of a logarithm at which they end; the smallest
variance, in squares of the noise: what fits better is rounding, or seen anew; times that a step's promise must not
suffice."""
PIVOTS, SIDE_ROUNDING, TAKEN_BACK = 60, 1e-10, 0.9
"""Changes at most of the columns held at zero; of the sums that tell it, what is rounding; less is no step back."""
SCALE_GRID = tuple(np.linspace(-6.0, 6.0, 25))
"""ln λ at which a block that might be added is weighed: three standard deviations of the widest prior, in steps of one
of the narrowest."""
NEARLY, AT_ONCE = 3.0, 8
"""Log evidence below the best down to which neighbours are computed exactly, and how many before one is taken."""
PAIR_REACH, PAIRS = 6.0, 60
"""Log evidence that two changes of the best combination may lose together to be weighed together: 1 in 400; and how
many such pairs at most."""
LOOKED_BEYOND = 4
"""First blocks beside which a second one is tried, where one alone brings nothing: those that promise most."""
TIES = 3
"""Combinations as near, and of as many blocks, whose neighbours are weighed beside those of the best."""
DETOUR, DETOUR_FROM = 20.0, 60.0
"""Log evidence below the best down to which another setting of one block is tried in place of several: what they cost
and may have brought. And that to first order, which tells less than the exact one, from which that is computed."""
NARROW = 6
"""Columns up to which blocks of different width are weighed in one array: wider ones would fill it with zeros."""
NOISE_ROUNDS = 6
"""Rounds in which the noise that a further block leaves settles, and which of its columns stay at zero."""
FLATTEST_PEAK = 0.5
"""Curvature of a peak over ln λ, that of the prior being 1: of a flatter one a parabola is up to 0.9 nat off."""
FIRST_ROUNDS = 5
"""Rounds of choice, outliers and noise at most: they settle after two or three."""
MOST_LEVERAGE = 0.999
"""Largest leverage, the share of the equations that a fit takes up, with which its residual tells the noise."""
FIT_STEPS = 30
"""Gauss-Newton steps at most: quadratic convergence needs four, a curved valley of a robot with large errors many."""
DAMPINGS = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""Of a step's information, added to it (Marquardt, *J. SIAM* 11, 1963): the first that betters the fit is taken; where
none does, it ends there."""
SELECTIONS = 3
"""Choices among all terms: of the known effects, then twice with what nobody listed; another where one is taken out."""
REVISIONS = 3
"""Times that a choice is made again at its own exact fit."""
MANY_ROWS = 500
"""Above, a choice is revised once: each takes tens of seconds, and so many rows hardly change it."""
SETTLED, SETTLED_NAMED = 1e-4, 1e-2
"""Last step of a fit, in standard deviations; of one of named effects, where the next step is a thousandth of it."""
SETTLED_BETWEEN = 2.0
"""The same for a fit of many rows that is chosen anew: the step after it would be a hundredth of it."""
REFINEMENT = 1.6
"""Factor by which a constant is first moved: neighbours of the grid stand about 2.5 apart."""
REFINED_GAIN, REFINED_TRIES = 0.1, 16
"""Natural logarithms that a move of a constant must gain, and may miss in the end, a tenth of what is worth mentioning;
and how often its neighbours are tried: a factor of 1.6 is then halved to 1.0001."""
REFINED_FLAT = 8.0 * REFINED_GAIN
"""Natural logarithms lost on both sides, below which the vertex of their parabola is no more than that higher."""
ENOUGH_ROWS, ENOUGH_REMAINDER = 1500, 2000
"""Rows, of very many, that are scanned for laws and for scatter: a law that explains a hundredth of the remainder is
then seen, and a standard deviation known to two per cent; and the same for the tests of the remainder."""
DRAW_SEED, TEST_SEED = 61, 17
"""Of the rows drawn for a scan, and for a test: the same campaign always gets the same answer."""

# --- the linear problem ---

CHUNK = 1024
"""Rows whose columns stand in one array at a time: those of tens of thousands would fill the memory."""

SEEN = 1e-10
"""Of the largest eigenvalue of a scaled Gram matrix: a direction below it is rounding, an exact alias of others."""
STEP_FLOOR = 1e-13
"""The same of a Gauss-Newton step, where priors determine what the data do not."""
PROJECTED_FLOOR = 1e-12
"""Of a column's square before the frames were projected out: what is left below it is rounding."""
INFORMATION_FLOOR = 1e-5
"""Squared length of a column, in units of the noise, below which the data do not see it."""
CONTAINED, CONTAINED_LEFT = 1e-3, 0.5
"""A block is contained in another that leaves less of it than this share, or this squared length in noise."""
CONTAINS = 25.0
"""Squared length, in noise and at its expected size, from which what is contained is seen at all: five sigma."""

# --- laws that nobody wrote down ---

KNOTS, FEW_LEVELS = 5, 6
"""Of a smooth law: five suffice for most (Harrell 2001). A quantity with no more values than this is one of levels."""
OUTER_KNOTS = 0.02
"""Quantile of the outer knots: beyond it, a few rows alone would bend the law."""
NARROW_KNOTS = 0.2
"""Of an even share of the range: the least distance of two knots."""
HARMONICS = (1.0, 2.0, 3.0)
"""Orders of a joint's own position that are always tried: eccentricity, ellipticity, three supports."""
INNER_MARKS, MARKS = 0.06, 23
"""Quantile of the first place where a law may step or bend, and how many such places there are."""
SLIDE_WIDTH, BUMP_WIDTHS = 0.08, (0.04, 0.1)
"""Of the range: widths of smooth steps and bumps from which they are refined."""
MARK_STEP, WIDTH_STEP, MARK_ROUNDS = 0.03, 8.0, 10
"""First shift of a mark (of the range), the relative change of a width a shift, and halvings: to 3e-5 of the range."""
COARSER = 3.0
"""Nats that a law of the clock must gain beyond one of the sessions at its place, 20 to 1: else these say enough."""
LINK_QUANTITIES = 6
"""A segment has six components: only so many quantities that speak elsewhere are tried there."""
SHAPED, LEFT_OUT, COMPARED_LAWS = 6, 4, 8
"""Candidates of each remainder whose shape is looked at; effects of an explanation, up to which a law is looked for in
the remainder without each of them; and candidates that are compared jointly with the known effects."""
FEWEST_LEFT = 5
"""Equations that must be left beside a law for a test of it."""
LAW_FLOOR = 1e-6
"""Of the largest eigenvalue of a law's scaled Gram matrix: a direction below it is nearly a sum of the others, and
would yet be counted as a parameter."""
HIGHEST_ORDER, SHORTEST_PERIOD = 200.0, 0.004
"""Orders a turn up to which waves of a joint are looked for: twice the ratio of common gears; and the shortest wave
of one that slides, m: a fine ball screw's lead."""
LOWEST_ORDER = 0.5
"""Turns of the joint that the longest wave takes, inverted: a longer one is a bend, which smooth laws tell."""
ORDER_STEP, ORDER_CHUNK, ORDER_ZOOMS, MOST_ORDERS = 0.25, 256, 4, 100_000
"""Of the width of a peak, 2π over the joint's range: a quarter costs 5 % of a peak's height; orders that are measured
at a time; rounds in which the best one is refined, each eight times finer; orders of one joint, those of 60 turns."""
LATTICE = 1e-3
"""Of their spacing: positions that lie on a lattice to within this cannot tell an order from its alias."""
LOWEST_RIPPLE = 2.5
"""Orders a turn from which a wave is ripple: what comes round once or twice is an eccentric or oval wheel."""
RIPPLE_ROWS, MOST_WAVES, WAVES_REFUSED = 5000, 30, 2
"""Rows up to which ripple is looked for: 12 000 took nine minutes and 5.6 GiB; waves of one robot, five a joint; waves
of each joint that may do harm in rows held out before none is tried any more."""
SAME_ORDER = 0.05
"""Orders that differ by less are one: over a whole turn 0.3 rad of phase, a few hundredths of the wave's square."""
SLIP_SHARES = (0.03, 1.0)
"""Of the longest way between two turns: how far the first and the last element goes before it slips; one below is lost
motion, one above a spring that never slips."""
SLIP_STEPS, SLIPS_TOGETHER = (4, 2, 1), (1, 2, 4)
"""Of the grid of slips, four a factor of two: every which ones are tried over the whole range, and how many that stand
side by side: one element, one between two, several alike."""
RELAXED_WITHIN = (0.02, 0.06, 0.2)
"""Of the campaign's time: time constants from which a joint that relaxes after each start is refined; 3 times apart."""
SPLINE_FLOOR = 1e-8
"""Of the largest singular value: functions of a quantity below it are no functions of their own."""
NAMED, LIKELY_PLACE = 5, 0.01
"""Places, and quantities, that are listed of a remainder; and the probability of a place below which it is not."""
WORSE_ELSEWHERE = 1.05
"""Times the rms in regions held out: an explanation that leaves more goes astray between the poses measured."""

# --- what remains ---

LEVEL = 1e-3
"""p-value, corrected for the number of tests, below which a remainder is not called noise."""
MATERIAL_SCALE = 1.15
"""Times the stated noise: a remainder below it is not called large, as no stated noise is better known."""
MATERIAL_SHARE = 0.04
"""A law that explains less of the remainder than this is not worth a name."""
FEWEST_PAIRS = 12
"""Fewer pairs of near-repeats say nothing of the noise: they would tell it to a third."""
SHUFFLES, FEW_SHUFFLES, SHUFFLED_ROWS = 200, 40, 3000
"""Shuffles that tell chance likeness of neighbours; fewer above so many rows, where chance is nearly normal."""
CLIPPED = 4.0
"""Sigmas at which rows are clipped when neighbours are compared: no two rows decide it."""
NEIGHBOURS, FEWEST_NEIGHBOURS = 3, 20
"""Neighbours of each row in joint space, and the rows below which there are no neighbours."""
SPOILT = 0.03
"""Of all rows: as many an instrument spoils where its noise is clean; a tracker's lost beams are fewer."""
HEAVY_SIGMAS = 4.0
"""Standard deviations of chance by which a kurtosis must exceed the normal one to speak of heavy tails."""
FEWEST_ASIDE, ASIDE_MARKS = 3, 24
"""Rows set aside below which nothing can be said of what they have in common, as two are always side by side; and of
those set aside, between whose values ranges are tried: a twentieth of them is not missed."""

FEWEST_WITH_EVENTS, EVENT_MARKS, EVENT_CARRYING, LIKELY_EVENTS = 20, 32, 0.2, 3
"""Rows of a campaign, of fewer of which a part says nothing by itself; marks, spread evenly, between which runs are
looked for first; the share of an event's rows, the farthest off, without which the others must still speak for it; and
places of an event, the likeliest ones, that are compared."""
NEAR_IN_ORDER = 5
"""Rows before and behind one set aside among which others count as near: of gross errors at 3 %, two more are there
once in twenty-five."""

# --- scatter ---

FEWEST_ROWS = 10
"""Below, nothing can be said of scatter."""
FEWEST_CONTRASTS = 6
"""Differences of repeats below which visits and poses cannot be told apart."""
TAILS = 4.0
"""Degrees of freedom of the Student law that is tried beside the normal one."""
MOST_COMPONENTS = 6
"""Joints that scatter at once."""
CONVINCING = 3.0
"""Logarithm of a Bayes factor, 20 to 1: from it heavy tails are believed, and a step is measured by its period, no more
by the errors' size; a component that gains less overcomes no prior odds."""
NORMAL_ROWS = 1000
"""Above, the likelihood of a variance that is well seen is normal in its logarithm."""
DROP_95, SIGMAS_95 = 1.92, 1.96
"""Of the log likelihood at the ends of a 95 % interval: half the χ² quantile of one degree of freedom; and standard
deviations of a normal law from its middle to these ends."""
FULLY_TRIED = 3
"""Components fitted in full at each step of the search: those that promise most."""
MOST_INFLATION = 4.0
"""Of a mean square, for the parameters that were fitted."""
SCATTER_SETTLED = 1e-3
"""Gain in log likelihood at which scoring steps of variances end."""
SCATTER_ROUNDING = 1e-13
"""Of a covariance's trace: a joint that scatters a million times more than the instrument must not make it singular."""
LOG_VARIANCE = (-12.0, 14.0)
"""Range of the logarithm of a variance, in squares of the noise; a profile likelihood is followed over as much of it as
lies below the noise."""
VARIANCE_GRID = np.exp(np.linspace(np.log(1e-2), np.log(1e4), 22))
"""Variances of a component that are compared, in squares of the noise: a tenth to a hundred times its sigma."""
MEDIAN_SQUARE = 0.455
"""Median of χ² with one degree of freedom: turns the median of squares into a variance."""
SCATTER_RIDGE = 1e-3
"""Information added to each log variance: one that nothing determines then moves by nothing."""
SCATTER_STEP, SCATTER_CUT = 2.0, 3.0
"""Largest step of a log variance, and by what it is divided where it does not help."""
PROFILE_ROOT = 0.02
"""How finely the end of a profile likelihood is found, in logarithms of a variance."""
SCATTER_SURE = 0.5
"""Probability from which scatter is named."""
SCATTER_PASSES = 3
"""Times that rows set aside, frames and scatter are settled together."""
SCATTER_LAW_SHARE = 0.15
"""Of a scatter that a smooth law must explain to make it none."""
STEPS_HIDDEN = 0.05
"""Chance that steps stay hidden where they should show, as another joint errs too: nothing speaks e³ against them."""
RIVALS = 2.0
"""Prior odds of other causes against an encoder, in a joint that errs anew from pose to pose: wear or a ripple too fine
for its period to be looked for, and what nobody recorded, each as probable."""
BAND = 1.35
"""The step is looked for within this factor of what the scatter's size says: its 99.9 % interval with 30 poses."""
STEP_SLACKS = (0.05, 0.1, 0.2)
"""Of a step: how even an encoder's positions are, as interpolated ones, and how much of the errors is of others."""
STEP_BANDS, STEP_PHASES, STEP_HARMONICS = 12, 32, 8
"""Bands of frequency, 5 % each, in which errors count in one step; phases; harmonics that such a slack leaves."""
STEP_POSES, MOST_FREQUENCIES = 200, 500_000
"""Poses of a search for steps, more only say it more surely; and frequencies: some seconds of time, and 0.2 GB."""

# --- findings ---

DETERMINED = 0.5
"""A parameter is identified when the data leave less than half of its prior's standard deviation."""
DISTINCT = 0.1
"""Of its expected size: a parameter that is less apart from those told before it is told as not seen, as its number
would be ten times as uncertain as theirs."""
UNHELD = 30.0
"""Times its prior deviation: that of a parameter that is told as if it had none; it moves what is identified by 1/3600.
"""
NAMING_ODDS = 9.0
"""Of an effect against nothing in its place: who takes a gear apart for what is named is then wrong once in ten."""
IN_ITS_PLACE = 0.01
"""Probability that another effect is at work in an effect's place, from which both are told: less is no doubt."""
INTERVAL = (0.025, 0.975)
"""Quantiles of every interval, and ends of a test at its level: of naming a quantity that a remainder follows."""
LEAST_HELD = 1e-6
"""Of an effect's expected size: to less its parameters are not held where it is fitted without others."""
FOLD_ROUNDS = 3
"""Rounds of noise in the fit of a subset of effects: what a subset leaves out is noise to it."""
HARDER = 1.25
"""Times what is left of rows held out on average: a way of holding out that leaves more is told beside it."""
FRAME_PRIOR = 1e-12
"""Of a frame's own information, added to it, so that what nothing determines stays where it is."""
FRAGILE = 1e-3
"""Probability of the verdict with other prior sizes, below which that is said: nobody knows them to a factor of 3."""
CONTRADICTED, AGAINST_GRAVITY = 0.01, -0.5
"""rad or m: no settled servo is as far from its command. Correlation of torque and weight that a wrong sign makes."""
STATED_TOO_LARGE = 0.5
"""Of the stated noise: less that remains says that it is stated too large."""
KERNEL_FLOOR = 1e-2
"""Of the noise's variance: what rows have in common below it is left out where rows are held out."""
