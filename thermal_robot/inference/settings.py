"""Chosen numbers of inference and findings, each with its unit and reason.

Numbers of a single effect are in its own file.
"""

import numpy as np

# --- what is believed before the data ---

PRIOR_PROBABILITY = 1.0 / 6.0
"""Prior probability of an effect, or random effect: two or three of sixteen; a probe named 2 to 5 on nine robots."""
COARSENESS = 1.0
"""Standard deviation of ln κ, the factor that all expected sizes of one robot share: an arm three times as coarse as
catalogues say in one respect is so in the others, as servo arms and series elastic ones are, and fine arms are fine."""
IN_ALL, ONE_MORE = 1.0 / 3.0, 0.5
"""Prior probabilities, given an effect, that it acts in all its places, and in one; each further place halves the
latter, so that all sum to one."""
LEADING_PLACES = 4
"""Largest number of places tried together once an effect was found in all: those with the largest effect."""
GIVEN_NOISE_DOF = 20.0
"""Prior degrees of freedom of a stated noise: it is trusted to about 15 %, as data sheets are."""
NOISE_SLACK = 1.3
"""Factor on a noise, stated or from repeats: a remainder above it is no longer that noise (two sigma of those 15 %)."""
SAME_NOISE = 1.1
"""Factor between two estimates of a kind's noise below which they are the same: weights that are off by a fifth cost a
hundredth of the accuracy."""
MISTRUST = 5.0
"""Largest penalty, natural logarithm, for calling a stated noise wrong: e⁵, about 1 in 150."""
SMOOTH_PRIOR = 0.5
"""Prior probability of a smooth discrepancy that no effect and no law accounts for: as likely as not."""
TAUS = tuple(2.0 ** (k / 4) for k in range(-4, 25))
"""Rms of a discrepancy over the noise: below the first it is noise, above the last a mistake. In quarters of an octave:
beside a hundred independent errors a size a factor of two off costs 20 nats."""
TAU_STEPS = (4, 2, 1)
"""Strides in that grid with which the most probable amplitude is searched."""
LENGTHS = (1.4, 2.8)
"""Length scales of the discrepancy at the tool, in standard deviations of the inputs times the root of their number."""
LANDMARKS = 100
"""Landmarks of the Nyström approximation of a discrepancy of very many rows: smooth functions need no more."""
NYSTROM_FLOOR, SMOOTH_FLOOR = 1e-6, 1e-9
"""Eigenvalue floors of a discrepancy, of the largest eigenvalue and of the noise's variance: below is rounding."""
NO_BACKGROUND = ("approach", "torque", "velocity", "acceleration", "order", "time", "temperature")
"""Prefixes of quantities left out of the discrepancy of places: a function of one is a known effect of a joint.
Positions and conditions stay, as unlisted causes follow them."""
COSINES = 5
"""Cosine features of each quantity in the discrepancy of places: with amplitudes 1/k² further ones bring 1 %."""
ERROR_AT_JOINT, ERROR_ELSEWHERE = 3e-4, 1e-4
"""Prior sizes of errors in a joint, rad, and in a twist elsewhere, m and rad, in proportion; also of unlisted laws."""
LEVER = 0.3
"""Lever arm, m: a discrepancy of the tool rotates it by its displacement over this length."""
STARTS = 3
"""Number of start combinations, the best ones, beside which each kernel of a discrepancy is tried."""
SCATTERING = 3
"""Largest number of joints with a per-pose or per-visit discrepancy beside each other."""
PARTS = tuple(2.0 ** (k / 2) for k in range(-3, 4))
"""Rms of a further joint over that of those before it, in halves of an octave."""
KERNEL_REACH = 20.0
"""Deficit of log evidence at which a kernel of the discrepancy is dropped while a fit iterates."""
AMPLITUDE_REACH = 5.4
"""Deficit of log evidence up to which an amplitude of a discrepancy counts: 1 in 200, four amplitudes an octave."""

# --- rounding ---

ROUNDING = 1e-9
"""Rounding error, m and rad: no table and no robot is more accurate; a smaller step of the frames is their last."""
UNSEEN, ALIAS = 1e-12, 1e-6
"""Rounding floors: m and rad, of a displacement by an expected size, and of distances; and share of a column's length:
an exact alias leaves less once others are projected out, and so does a joint that cannot be seen to scatter."""
TINY, BETTER = 1e-300, 1e-9
"""Floor of divisors, against infinite quotients; and difference of log evidence below which no explanation is better
than another."""
SAME_COMMAND = 1e-6
"""Tolerance of equal commands, rad or m; controllers print fewer digits."""

# --- rows: which belong together, which are set aside ---

NEAR = 0.01
"""Clustering distance of repeats, rad, m for a prismatic joint: a tool 1 m out then stays within a centimetre."""
CLOSEST = 1e-7
"""Smallest clustering distance, rad or m: where clusters still chain together, they are the same command."""
LARGEST_CLUSTER = 0.1
"""Largest share of the rows in a cluster: a larger one is a path, not a repeated pose."""
FOLDS = 5
"""Number of regions of joint space held out in turn; of temperature, reach and joint ranges the outermost fifth is."""
WRITTEN_TO = 1e-5
"""Resolution, m and rad, of a controller's poses where no noise is stated: screens show a tenth of a millimetre, topics
all digits, and no difference of a model that matters is smaller."""
TURNS_TRIED = 4
"""Initial rotations of the target on the tool that are refined: the first of a cube may be the best one's neighbour."""
FEWEST_STANDS = 3
"""Fewest stands for leave-one-stand-out cross-validation: of fewer, what is left is another campaign."""
BLOCKS = 20
"""Number of blocks of consecutive rows held out in turn: twenty values tell the spread of a figure to a sixth."""
GROSS_LEVEL = 0.01
"""Level of the outlier test: the chance that noise alone sets any row of a campaign aside."""
GROSS_FACTOR = 1.5
"""Factor on the squared distance at that level: tails of real instruments are a little heavier than normal."""
BEND_LEVEL = 0.01
"""Huber's threshold, as the share of sound rows that weigh less than fully."""
MOST_OUTLIERS = 0.25
"""Largest share of outliers among the rows: more are not gross errors but another motion."""
CAUCHY_SCALE = 1.5
"""Scale of the Cauchy weights that find the frames, over the median distance: a third of the rows may be wrong."""
CAUCHY_ROUNDS = 4
"""Iterations of weights and noise in a scan: they settle to a per cent."""
RUN = 3
"""Consecutive outliers that count as a change: of five gross errors in a hundred, three are so once in 170."""
FEW_ASIDE = 0.05
"""Share of all rows: fewer consecutive outliers may be one lapse of the instrument. Scatter must show without as many
of its most influential rows, too: of normal scatter they hold a quarter of its variance."""

# --- iterations, and how many rows suffice ---

START_ROWS = 400
"""Rows on which starts of the registration are compared: the frames are then known far better than any start needs."""
START_ROUNDS, START_SETTLED = 200, 1e-5
"""Largest number of alternations of base and tool, and of steps of the frames; relative change of the median distance
at which alternations end."""
TARGET_STARTS = np.vstack([np.zeros(3), 0.2 * np.eye(3), -0.2 * np.eye(3)])
"""Initial places of the target on the tool frame, m; from each the fit reaches 0.3 m."""
SPARE_EQUATIONS = 6
"""Fewest equations left once the frames are fitted: as many as one pose has."""
EVIDENCE_STEPS, EVIDENCE_SETTLED, LEAST_VARIANCE, CLEARLY = 40, 1e-3, 1e-6, 4.0
"""Largest number of Newton steps of scales, noise and variances; change of a logarithm at which they end; smallest
variance, in squares of the noise: what fits better is rounding; factor on a step's predicted gain that must not
suffice."""
PIVOTS, SIDE_ROUNDING, TAKEN_BACK = 60, 1e-10, 0.9
"""Largest number of pivots; relative rounding of the signs that tell them; share of a reversed step that is a cycle."""
SCALE_GRID = tuple(np.linspace(-6.0, 6.0, 25))
"""Grid of ln λ over which the gain of one more block is integrated: three standard deviations of the widest prior, in
steps of one of the narrowest."""
NEARLY, AT_ONCE = 3.0, 8
"""Deficit of log evidence up to which neighbours are evaluated exactly, and how many before one is taken."""
PAIR_REACH, PAIRS = 6.0, 60
"""Largest joint loss of log evidence at which two changes of the best combination are evaluated as a pair: 1 in 400;
and the largest number of such pairs."""
LOOKED_BEYOND = 4
"""Number of first blocks, the most promising, beside which a second is tried where one alone brings nothing."""
TIES = 3
"""Number of near ties, combinations of as many blocks, whose neighbours are evaluated beside those of the best."""
DETOUR, DETOUR_FROM = 20.0, 60.0
"""Deficits of log evidence up to which another setting of one block is tried in place of several: by the exact value;
and by the first-order value, which tells less."""
NARROW = 6
"""Largest number of columns of blocks that are padded to one array: wider ones would fill it with zeros."""
NOISE_ROUNDS = 6
"""Fixed-point iterations of the noise left by a further block, and of which of its columns stay at zero."""
FLATTEST_PEAK = 0.5
"""Smallest curvature of a peak over ln λ, the prior's being 1: Laplace's method is up to 0.9 nat off beyond."""
FIRST_ROUNDS = 5
"""Largest number of iterations of selection, outliers and noise: they settle after two or three."""
MOST_LEVERAGE = 0.999
"""Largest leverage, the share of the equations that a fit takes up, with which its residual tells the noise."""
FIT_STEPS = 30
"""Largest number of Gauss-Newton steps: quadratic convergence needs four, a curved valley of large errors many."""
DAMPINGS = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""Levenberg-Marquardt damping factors of the information (Marquardt, *J. SIAM* 11, 1963): the first that betters the
fit is taken; where none does, it ends there."""
SELECTIONS = 3
"""Rounds of model selection: of known effects, then twice with unlisted terms; another where one is taken out."""
REVISIONS = 3
"""Most rounds of exact fit and outliers of named effects; it ends earlier where outliers and noise stay."""
SETTLED, SETTLED_NAMED = 1e-4, 1e-2
"""Last step of a fit, in standard deviations; that of named effects, where the next step is a thousandth of it."""
SETTLED_BETWEEN = 2.0
"""Last step, in standard deviations, of a fit before another selection: the next would be a hundredth of it."""
REFINEMENT = 1.6
"""Factor by which a constant is first moved: neighbours of the grid stand about 2.5 apart."""
REFINED_GAIN, REFINED_TRIES = 0.1, 16
"""Gain of log evidence that a move of a constant must bring, and may miss in the end, a tenth of what is worth
mentioning; and number of tries: a factor of 1.6 is then halved to 1.0001."""
REFINED_FLAT = 8.0 * REFINED_GAIN
"""Loss of log evidence on both sides below which the vertex of their parabola is no more than `REFINED_GAIN` higher."""
ENOUGH_ROWS, ENOUGH_REMAINDER = 1500, 2000
"""Size of the sample of very many rows for laws and scatter: a law that explains a hundredth of the remainder is then
seen, and a standard deviation known to two per cent; and for the tests of the remainder."""
DRAW_SEED, TEST_SEED = 61, 17
"""Random seeds of the rows drawn for a scan, and for a test: the same campaign always gets the same answer."""

# --- the linear problem ---

CHUNK = 1024
"""Rows whose columns stand in one array at a time: those of tens of thousands would fill the memory."""

SEEN = 1e-10
"""Rank tolerance, of the largest eigenvalue of a scaled Gram matrix: a direction below is an exact alias of others."""
STEP_FLOOR = 1e-13
"""Rank tolerance of a Gauss-Newton step, where priors determine what the data do not."""
PROJECTED_FLOOR = 1e-12
"""Share of a column's square that must be left once the frames are projected out: less is rounding."""
INFORMATION_FLOOR = 1e-5
"""Squared length of a column, in units of the noise, below which the data do not see it."""
CONTAINED, CONTAINED_LEFT = 1e-3, 0.5
"""Residual share of a block, or its squared length in noise, beside another one below which that contains it."""
CONTAINS = 25.0
"""Squared length, in noise and at its expected size, from which a contained block is seen at all: five sigma."""

# --- laws that nobody wrote down ---

KNOTS, FEW_LEVELS = 5, 6
"""Knots of a smooth law: five suffice for most (Harrell 2001); largest number of values of a quantity of levels."""
OUTER_KNOTS = 0.02
"""Quantile of the outer knots: beyond it, a few rows alone would bend the law."""
NARROW_KNOTS = 0.2
"""Least distance of two knots, of an even share of the range."""
HARMONICS = (1.0, 2.0, 3.0)
"""Orders of a joint's own position that are always tried: eccentricity, ellipticity, three supports."""
INNER_MARKS, MARKS = 0.06, 23
"""Quantile of the first place where a law may step or bend, and number of such places."""
SLIDE_WIDTH, BUMP_WIDTHS = 0.08, (0.04, 0.1)
"""Initial widths of smooth steps and bumps, of the range, from which they are refined."""
MARK_STEP, WIDTH_STEP, MARK_ROUNDS = 0.03, 8.0, 10
"""Pattern search of marks: first shift (of the range), relative change of a width a shift, halvings: to 3e-5."""
COARSER = 3.0
"""Gain, nats, that a law of the clock needs beyond one of the sessions at its place, 20 to 1: else these say enough."""
LINK_QUANTITIES = 6
"""Number of quantities, the best elsewhere, that are tried at a segment, which has six components."""
SHAPED, LEFT_OUT, COMPARED_LAWS = 6, 4, 8
"""Candidates of each remainder whose functional form is refined; effects of an explanation up to which laws are sought
in the remainder without each; candidates compared jointly with the known effects."""
FEWEST_LEFT = 5
"""Fewest equations left beside a law for a test of it."""
LAW_FLOOR = 1e-6
"""Rank tolerance, of the largest eigenvalue of a law's scaled Gram matrix: a direction below it is nearly a sum of the
others, and would yet be counted as a parameter."""
HIGHEST_ORDER, SHORTEST_PERIOD = 200.0, 0.004
"""Highest wave order of a joint, a turn: twice the ratio of common gears; and the shortest wave of a prismatic joint,
m: a fine ball screw's lead."""
LOWEST_ORDER = 0.5
"""Lowest wave order of a joint, a turn: a longer wave is a bend, which smooth laws tell."""
ORDER_STEP, ORDER_CHUNK, ORDER_ZOOMS, MOST_ORDERS = 0.25, 256, 4, 100_000
"""Spacing of wave orders over a peak's width, 2π over the joint's range: a quarter costs 5 % of its height; orders at a
time; rounds of refinement, each eight times finer; orders of one joint at most, those of 60 turns."""
LATTICE = 1e-3
"""Tolerance, of their spacing, of positions on a lattice, which cannot tell an order from its alias."""
LOWEST_RIPPLE = 2.5
"""Lowest order of ripple, a turn: what comes round once or twice is an eccentric or oval wheel."""
RIPPLE_ROWS, MOST_WAVES, WAVES_REFUSED = 5000, 30, 2
"""Largest number of rows with a search for ripple: 12 000 took nine minutes and 5.6 GiB; of waves of one robot, five a
joint; and of rounds of waves, one a joint, that may harm held-out rows before the search ends."""
SAME_ORDER = 0.05
"""Tolerance of equal orders: over a whole turn 0.3 rad of phase, a few hundredths of the wave's square."""
SLIP_SHARES = (0.03, 1.0)
"""Smallest and largest slip limit of stop operators, of the longest way between two turns: one below is lost motion,
one above a spring that never slips."""
SLIP_STEPS, SLIPS_TOGETHER = (4, 2, 1), (1, 2, 4)
"""Strides in the grid of slip limits, four a factor of two, of the sets over the whole range; and numbers of
neighbours: one element, one between two, several alike."""
RELAXED_WITHIN = (0.02, 0.06, 0.2)
"""Initial time constants of relaxation after each start, of the campaign's time, before refinement; 3 times apart."""
SPLINE_FLOOR = 1e-8
"""Rank tolerance of the basis of a quantity's functions, of the largest singular value."""
NAMED, LIKELY_PLACE = 5, 0.01
"""Largest number of places, and of quantities, listed for a remainder; and smallest probability of a listed place."""
WORSE_ELSEWHERE = 1.05
"""Largest ratio of the rms in held-out regions with and without a wave: a larger one goes astray between poses."""

# --- what remains ---

LEVEL = 1e-3
"""Level of the residual tests: p-value, corrected for their number, below which a remainder is not called noise."""
MATERIAL_SCALE = 1.15
"""Ratio to the stated noise above which a remainder is called large, as no stated noise is better known."""
MATERIAL_SHARE = 0.04
"""Smallest share of the remainder that a law must explain to be named."""
FEWEST_PAIRS = 12
"""Fewest pairs of near-repeats that tell the noise: to a third."""
SHUFFLES, FEW_SHUFFLES, SHUFFLED_ROWS = 200, 40, 3000
"""Permutations of the autocorrelation test; fewer above so many rows, where chance is nearly normal."""
CLIPPED = 4.0
"""Clipping limit of rows in that test, sigmas: no two rows decide it."""
NEIGHBOURS, FEWEST_NEIGHBOURS = 3, 20
"""Nearest neighbours of each row in joint space, and the rows below which there are none."""
SPOILT = 0.03
"""Rate of gross errors of an instrument whose noise is clean, at most; a tracker's lost beams are fewer."""
HEAVY_SIGMAS = 4.0
"""Standard errors by which a kurtosis must exceed the normal one to speak of heavy tails."""
FEWEST_ASIDE, ASIDE_MARKS = 3, 24
"""Fewest outliers of which something in common can be said, as two are always side by side; and number of outliers
between whose values ranges are tried: a twentieth of them is not missed."""

FEWEST_WITH_EVENTS, EVENT_MARKS, EVENT_CARRYING, LIKELY_EVENTS = 20, 32, 0.2, 3
"""Fewest rows of a campaign with a search for events; marks, spread evenly, between which runs are looked for first;
share of an event's rows, the farthest off, without which the others must still speak for it; and places of an event,
the likeliest ones, that are compared."""
NEAR_IN_ORDER = 5
"""Rows before and behind an outlier among which others count as near: of gross errors at 3 %, two more are there once
in twenty-five."""

# --- scatter ---

FEWEST_ROWS = 10
"""Fewest rows for an estimate of scatter."""
FEWEST_CONTRASTS = 6
"""Fewest contrasts of repeats that tell visits and poses apart."""
TAILS = 4.0
"""Degrees of freedom of the Student law that is tried beside the normal one."""
MOST_COMPONENTS = 6
"""Largest number of joints that scatter at once."""
CONVINCING = 3.0
"""Log Bayes factor, 20 to 1, from which heavy tails are believed, and a step is measured by its period, no more by the
errors' size; a component that gains less overcomes no prior odds."""
NORMAL_ROWS = 1000
"""Rows above which the likelihood of a well-determined variance is normal in its logarithm."""
DROP_95, SIGMAS_95 = 1.92, 1.96
"""Drop of the log likelihood at the ends of a 95 % interval: half the χ² quantile of one degree of freedom; and
standard deviations of a normal law from its middle to these ends."""
FULLY_TRIED = 3
"""Number of components fitted in full at each step of the search: those that promise most."""
MOST_INFLATION = 4.0
"""Largest inflation of a mean square for the parameters that were fitted."""
SCATTER_SETTLED = 1e-3
"""Gain of log likelihood at which Fisher scoring of variances ends."""
SCATTER_ROUNDING = 1e-13
"""Ridge of a covariance, of its trace: a joint that scatters a million times more must not make it singular."""
LOG_VARIANCE = (-12.0, 14.0)
"""Range of the logarithm of a variance, in squares of the noise; a profile likelihood is followed over as much of it as
lies below the noise."""
VARIANCE_GRID = np.exp(np.linspace(np.log(1e-2), np.log(1e4), 22))
"""Variances of a component that are compared, in squares of the noise: a tenth to a hundred times its sigma."""
MEDIAN_SQUARE = 0.455
"""Median of χ² with one degree of freedom: turns the median of squares into a variance."""
SCATTER_RIDGE = 1e-3
"""Ridge on the information of log variances: one that nothing determines then does not move."""
SCATTER_STEP, SCATTER_CUT = 2.0, 3.0
"""Largest step of a log variance, and divisor of one that does not help."""
PROFILE_ROOT = 0.02
"""Accuracy of the end of a profile likelihood interval, in logarithms of a variance."""
SCATTER_SURE = 0.5
"""Probability from which scatter is named."""
SCATTER_PASSES = 3
"""Number of iterations of outliers, frames and scatter."""
SCATTER_LAW_SHARE = 0.15
"""Share of a scatter that a smooth law must explain to make it none."""
STEPS_HIDDEN = 0.05
"""Prior probability that steps stay hidden, as another joint errs too: the evidence against them is at most e³."""
RIVALS = 2.0
"""Prior odds of other causes against an encoder, in a joint that errs anew from pose to pose: wear or a ripple too fine
for its period to be looked for, and what nobody recorded, each as probable."""
BAND = 1.35
"""Factor on the step implied by the scatter's size within which it is searched: its 99.9 % interval with 30 poses."""
STEP_SLACKS = (0.05, 0.1, 0.2)
"""Slacks of quantisation, of a step: how even an encoder's positions are, and how much of the errors is of others."""
STEP_BANDS, STEP_PHASES, STEP_HARMONICS = 12, 32, 8
"""Bands of frequency, 5 % each, in which errors count in one step; phases; harmonics that such a slack leaves."""
STEP_POSES, MOST_FREQUENCIES = 200, 500_000
"""Largest numbers of poses, more only say it more surely, and of frequencies of a step search: seconds and 0.2 GB."""

# --- findings ---

DETERMINED = 0.5
"""Ratio of posterior to prior standard deviation below which a parameter is identified."""
DISTINCT = 0.1
"""Share of a parameter's expected size that must be independent of those told before it: one with less is told as not
seen, as its number would be ten times as uncertain as theirs."""
UNHELD = 30.0
"""Factor on the prior deviation of a parameter told as if it had none; it moves what is identified by 1/3600."""
NAMING_ODDS = 9.0
"""Posterior odds from which an effect is named: who takes a gear apart for one is then wrong once in ten."""
IN_ITS_PLACE = 0.01
"""Probability of an alternative in an effect's place from which both are told: less is no doubt."""
INTERVAL = (0.025, 0.975)
"""Quantiles of every 95 % interval, and ends of a test at its level: of naming a quantity that a remainder follows."""
LEAST_HELD = 1e-6
"""Floor of prior deviations, of an effect's expected size: of parameters held at zero, or fitted without others."""
FOLD_ROUNDS = 3
"""Iterations of the noise in the fit of a subset of effects: what a subset leaves out is noise to it."""
HARDER = 1.25
"""Ratio of held-out rms to the average from which a scheme of folds is reported beside it."""
FRAME_PRIOR = 1e-12
"""Ridge on the frames, of their own information, so that what nothing determines stays where it is."""
FRAGILE = 1e-3
"""Probability of the verdict with other prior sizes, hardly known to a factor of 3, below which a warning is given."""
CONTRADICTED, AGAINST_GRAVITY = 0.01, -0.5
"""Command error, rad or m, that no settled servo has; and correlation of torque and weight that a wrong sign makes."""
STATED_TOO_LARGE = 0.5
"""Ratio of the remainder to the stated noise below which that is called too large."""
KERNEL_FLOOR = 1e-2
"""Eigenvalue floor, of the noise's variance, of the covariance between rows where rows are held out."""
