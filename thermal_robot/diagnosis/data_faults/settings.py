"""Chosen numbers of the search for data faults, each with its unit and reason."""

MISFIT = 0.003
"""Of the volume over which the arm moved: a gap after registration above it asks for the search. Six public and 22
simulated campaigns leave 0.00001 to 0.0028; what it costs where it is in vain is seconds, not a false alarm."""
ANOTHER_MOTION, ANOTHER_TURN = 0.02, 0.2
"""Of the volume that was measured, and rad: a gap after correction above either is not a robot's. An arm of a metre
would err by centimetres, a joint by eleven degrees."""
FALL = 3.0
"""Times that the gap must fall: what is wrong with a robot stays whatever is done to its table. The best of all
candidates brings 28 sound campaigns a factor of 1.0 to 1.5; faults of tables bring factors of ten to ten thousand."""
TIE = 3.0
"""Natural logarithms by which a candidate must be better than another one to be told from it: odds of 20."""
LEAST_GAP = 1e-6
"""m: a smaller gap is rounding of the table."""
STRAY = 10.0
"""Times the median gap: rows beyond it stray. Of normal noise none is beyond 4, of heavy-tailed noise one in a
thousand."""
FEW_STRAYS, LEAST = 0.05, 0.01
"""Share of the rows that must stray at least, as fewer fit by chance as they stand, or stray; and the least gap, of a
misfit, by which straying is counted: where noise is all, a gross error of a few tenths of a millimetre is none."""
MIXTURE_ROUNDS = 4
"""Rounds in which rows are told to be struck or not, and the frames fitted to both: they settle after three."""
PART_ROUNDS = 2
"""Times that the frames are fitted to the rows that do not stray: the first ones may be pulled by those that do."""
DRAWS, DRAWN = 300, 5
"""Draws of so many rows, from which frames are begun where half of the rows may be wrong: with five rows one draw in 32
is free of them, so that nine of 300 are; fewer rows do not determine two frames."""
DRAWS_HALVED = 10
"""Of the draws one in so many goes on, with the rows that it brings near."""
ABREAST = 256
"""Candidates whose frames are fitted side by side: more would not stay in the processor's memory."""
WORSE = 10.0
"""Times the least of the numbers tried, above which no difference is made when one is refined."""
NEAREST = 0.4
"""Share of the rows, nearest to the prediction, by which such a beginning is judged."""
SAMPLED, SKETCHED = 150, 40
"""Rows on which candidates are compared, spread evenly: a median is then known to a tenth; and those on which rigid
frames are first fitted to them."""
STILL = (0.1, 0.03)
"""Of what a robot that does not move leaves, for one fault and for two: with more left a repair only makes the joints
stand still, and mends nothing. Of 25 public and simulated robots none leaves more than a fiftieth; of pairs there are
many thousands."""
FEWEST_RELAXED, RIDGE = 18, 1e-10
"""Rows for a map of place and turn together, which has 13 numbers an axis: with fewer it fits whatever is there; and
what steadies its equations, of their trace: an arm in a plane does not determine them all."""
RELAXED = 60
"""Rows on which maps are fitted to each candidate: 180 equations for 39 numbers."""
SURVIVORS, NEAR, MOST_SURVIVORS = 24, 3.0, 128
"""Candidates for the joints that are looked at with rigid frames: so many, and all that leave less than so many times
the least, since they may do the same, but not more than these."""
EXTENT = 2.0
"""Times that the extent of the measured points may differ from that of the predicted ones, for their unit to be right:
a target beside the tool frame changes it by less, and units differ by 2.54 and more."""
MOST_PATTERNS, FEW_REVERSED = 10, 3
"""Joints up to which every pattern of signs is tried: 1023; beyond, up to so many reversed ones."""
PAIRED_PATTERNS = 128
"""Patterns of signs, those of fewest joints, that are tried together with another fault."""
TOLD = 4
"""Alternatives that are told at most."""
WINDOW = 100
"""Rows, one after the other, on which clocks are compared: to give back what was mixed a matrix of them is inverted."""
COARSE_ROUNDS = 40
"""Alternations of base and tool in a first look: what fits has come within a tenth of its gap by then."""
FULLY = 12
"""Candidates, those that promise most, that are aligned from every start: two faults with all their aliases."""
MOST_SHIFT = 3
"""Rows by which columns may stand shifted: a header or a first pose too many or too few, twice."""
ORDERED = 0.5
"""Of the median time between rows: the step of the search for a clock's offset."""
NEAR_OFFSETS, FAR_OFFSETS, SMALLEST_OFFSET = 6.0, 200.0, 0.02
"""Times the median time between rows: up to the first the search is linear, up to the second geometric, and from the
third on."""
OFFSET_RATIO = 1.4
"""Of one offset to the next where they are geometric: within a sixth of the true one the gap falls sixfold."""
PROMISING = 1.2
"""Times that the gap falls at the best of the offsets tried, for it to be refined: beside the true one it does."""
OFFSET_SETTLED = 1e-5
"""Of the bracket of an offset: the accuracy to which it is refined."""
MIXED_ROWS = 400
"""Rows up to which mixed readings are unmixed: the matrix is inverted."""
UNMIXED = 1e-6
"""Singular value of a mixture, of its largest, below which nothing is given back, as readings have six digits; and what
a row's own weight in what is given back may lack: with less it is not determined."""
PRIOR_TURN, PRIOR_ZERO = 0.1, 0.5
"""rad of an axis and of a joint's zero: one sigma to which a free calibration holds what it moves; places are held to
``FARTHEST``. Little of what is determined is held by it; the zeros are freest, as a horn is soon mounted a tooth
farther."""
ANOTHERS = 1e6
"""Times the precision of what a joint has of its own: to which that is held which another joint has."""
CALIBRATED, ROUNDED = 1e-3, 1e-9
"""Share of a calibration's cost by which its last step falls; and of the largest weight of a frame's motion, by which
those are held that nothing determines."""
STEP_SHARES = (1.0, 0.5, 0.25, 0.1)
"""Of a step, in the order in which they are tried, until one leads downhill."""
MEDIAN = 1.54
"""Median length of a normal vector in three dimensions, of its sigma per axis."""
FARTHEST, ALONE = 0.02, 10.0
"""Of the arm's length, by which no joint sits off its place: industrial arms err by a thousandth, printed servo arms by
a hundredth; half of it where the joint is alone with it, so many times farther off than the median of all: chance makes
that two or three."""
CLEARLY = 5.0
"""Times what a calibration leaves: what is not geometric feigns that a joint sits off by up to some times as much."""
PARTS, PART_ROWS = 4, 12
"""Parts at most into which rows in their order are divided for frames of their own, and rows of each at least: a base
that was moved once or twice then stands still in most of them, and twelve rows determine two frames three times."""
SCALE_ERROR = 0.05
"""By which a common factor of the links is another model's: cameras without a scale bar err by a hundredth."""
FACTOR_ROUNDS = 25
"""Steps in which a common factor of the links is found: to a thousandth."""
HAND_JOINTS = 6
"""Joints that a robot at hand may have beside those of the chain, a gripper's; and ends of an arm: those of a hand."""
LIKE_ANOTHER = 0.9
"""Times what a robot at hand leaves, above which another one is like it: the same arm with other limits, or a hand."""
SAME_PLACE, MOST_BEHIND = 3.0, 0.1
"""Times the median gap within which measured places are one: the instrument alone scatters less, and two commands that
are far apart are never so near by chance. And the share of the rows up to which some that follow each other may be left
out as measured a command too early or too late: of more the table is to be paired anew."""
