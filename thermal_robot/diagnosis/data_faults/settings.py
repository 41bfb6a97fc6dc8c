"""Chosen numbers of the search for data faults, each with its unit and reason."""

MISFIT = 0.003
"""Gap after registration, of the volume over which the arm moved, from which data faults are searched. Six public and
22 simulated campaigns leave 0.00001 to 0.0028; what it costs where it is in vain is seconds, not a false alarm."""
ANOTHER_MOTION, ANOTHER_TURN = 0.02, 0.2
"""Gap after correction, of the measured volume and in rad, above which it is not a robot's. An arm of a metre would err
by centimetres, a joint by eleven degrees."""
FALL = 3.0
"""Factor by which a repair must reduce the gap: a robot's own errors stay whatever is done to its table. The best
candidate brings 28 sound campaigns a factor of 1.0 to 1.5; faults of tables bring factors of ten to ten thousand."""
TIE = 3.0
"""Log likelihood ratio below which two candidates cannot be told apart: odds of 20."""
LEAST_GAP = 1e-6
"""Rounding error of the table, m: smaller gaps count as this one."""
STRAY = 10.0
"""Outlier limit over a typical gap. Of normal noise none is beyond 4, of heavy-tailed noise one in a thousand."""
FEW_STRAYS, LEAST = 0.05, 0.01
"""Smallest share of outliers that are a group, as fewer fit by chance as they stand, or stray; and smallest gap, of a
misfit, by which outliers are counted: where noise is all, a gross error of a few tenths of a millimetre is none."""
MIXTURE_ROUNDS = 4
"""Iterations of the mixture, rows classified and frames fitted to both parts: they settle after three."""
PART_ROUNDS = 2
"""Number of registrations, each on the inliers of the one before: outliers may have pulled that."""
DRAWS, DRAWN = 300, 5
"""Random draws of RANSAC, and rows in each, where half of the rows may be wrong: with five rows one draw in 32 is free
of them, so that nine of 300 are; fewer rows do not determine two frames."""
DRAWS_HALVED = 10
"""Divisor of the number of draws in each round: the best go on, with the rows that they bring near."""
ABREAST = 256
"""Number of candidates registered side by side: more would not stay in the processor's memory."""
WORSE = 10.0
"""Cap on the gap while a fault's number is refined, over the least gap on the grid: larger ones count alike."""
NEAREST = 0.4
"""Quantile of the rows' distances by which draws of RANSAC are compared, and above which outliers are counted."""
SAMPLED, SKETCHED = 150, 40
"""Rows on which candidates are compared, spread evenly: a median is then known to a tenth; and those on which rigid
frames are first fitted to them."""
STILL = (0.1, 0.03)
"""Largest gap over that of a robot at rest, for one fault and for two: with more left a repair only makes the joints
stand still, and mends nothing. Of 25 public and simulated robots none leaves more than a fiftieth; of pairs there are
many thousands."""
FEWEST_RELAXED, RIDGE = 18, 1e-10
"""Fewest rows for an affine map of place and turn together, which has 13 numbers an axis: with fewer it fits whatever
is there; and its ridge, of the trace: an arm in a plane does not determine all of them."""
RELAXED = 60
"""Rows on which affine maps are fitted to each candidate: 180 equations for 39 numbers."""
SURVIVORS, NEAR, MOST_SURVIVORS = 24, 3.0, 128
"""Number of candidates for the joints that go on to registration with rigid frames; ratio to the least gap below which
further ones do, since they may be equivalent; and largest number of all."""
EXTENT = 2.0
"""Largest ratio of the extents of measured and predicted points with the right unit: a target beside the tool frame
changes it by less, and units differ by 2.54 and more."""
MOST_PATTERNS, FEW_REVERSED = 10, 3
"""Largest number of joints of which every pattern of signs is tried: 1023; beyond, largest number of reversed ones."""
PAIRED_PATTERNS = 128
"""Number of patterns of signs, those of fewest joints, that are tried together with another fault."""
TOLD = 4
"""Largest number of alternative kinds of fault that a finding names."""
WINDOW = 100
"""Consecutive rows on which clocks are compared: to undo an interpolation a matrix of them is inverted."""
COARSE_ROUNDS = 40
"""Alternations of base and tool in a coarse registration: what fits is then within a tenth of its gap."""
FULLY = 12
"""Number of candidates, the most promising, registered from every start: two faults with all their aliases."""
MOST_SHIFT = 3
"""Largest shift of columns, rows: a header or a first pose too many or too few, twice."""
ORDERED = 0.5
"""Step of the linear search for a clock's offset, of the median time between rows."""
NEAR_OFFSETS, FAR_OFFSETS, SMALLEST_OFFSET = 6.0, 200.0, 0.02
"""Largest offsets, over the median time between rows, of the linear and of the geometric search, and the smallest
offset tried."""
OFFSET_RATIO = 1.4
"""Ratio of neighbouring offsets where they are geometric: within a sixth of the true one the gap falls sixfold."""
PROMISING = 1.2
"""Reduction of the gap at the best of the offsets tried from which it is refined: beside the true one it falls so."""
OFFSET_SETTLED = 1e-5
"""Accuracy to which an offset is refined, of its bracket."""
MIXED_ROWS = 400
"""Largest number of rows whose interpolation is undone: the matrix is inverted."""
UNMIXED = 1e-6
"""Rank tolerance of an interpolation that is undone, of its largest singular value, as readings have six digits; and
what a row's own weight in the result may lack: with less it is not determined."""
PRIOR_TURN, PRIOR_ZERO = 0.1, 0.5
"""Prior standard deviations of a joint's axis and zero in a free calibration, rad; places are held to ``FARTHEST``.
Little of what is determined is held by it; the zeros are freest, as a horn is soon mounted a tooth farther."""
ANOTHERS = 1e6
"""Factor on the prior precision of a joint's shift along the axis of the joint before, which is a shift of that one."""
CALIBRATED, ROUNDED = 1e-3, 1e-9
"""Relative decrease of a calibration's cost at its last step; and ridge on the frames, of the largest weight of their
motion, that holds those that nothing determines."""
STEP_SHARES = (1.0, 0.5, 0.25, 0.1)
"""Shares of a step, tried in this order until one descends."""
MEDIAN = 1.54
"""Median length of a normal vector in three dimensions over its sigma per axis."""
FARTHEST, ALONE = 0.02, 10.0
"""Largest error of a joint's place, of the arm's length: industrial arms err by a thousandth, printed servo arms by a
hundredth; half of it where the joint is alone with it, so many times farther off than the median of all: chance makes
that two or three."""
CLEARLY = 5.0
"""Standard deviations by which a joint's misplacement exceeds what robots err by: few poses determine it to
centimetres, and nongeometric errors make it wrong by more than one."""
PARTS, PART_ROWS = 4, 12
"""Largest number of parts of rows in their order with frames of their own, and fewest rows of each: a base that was
moved once or twice then stands still in most of them, and twelve rows determine two frames three times."""
SCALE_ERROR = 0.05
"""Common scale error of links from which they are another model's: cameras without a scale bar err by 1 %."""
FACTOR_ROUNDS = 25
"""Steps of the search for a common factor of the links: to a thousandth."""
HAND_JOINTS = 6
"""Largest numbers of joints of a shipped robot beside those of the chain, a gripper's, and of ends, a hand's."""
LIKE_ANOTHER = 0.9
"""Ratio of gaps above which two shipped robots are alike: the same arm with other limits, or a hand."""
SAME_PLACE, MOST_BEHIND = 3.0, 0.1
"""Distance of equal measured places over the median gap: the instrument alone scatters less, and two commands that are
far apart are never so near by chance. And the share of the rows up to which some that follow each other may be left out
as measured a command too early or too late: of more the table is to be paired anew."""
