"""Every number that was chosen to find faults of the data: its value, its unit, and why that one."""

import math

MISFIT = 0.003
"""Of the volume over which the arm moved: a gap after registration above it asks for the search. Six public and 22
simulated campaigns leave 0.00001 to 0.0028; what it costs where it is in vain is seconds, not a false alarm."""
ANOTHER_MOTION, ANOTHER_TURN = 0.02, 0.2
"""Of the volume that was measured, and rad: a gap after correction above either is not a robot's. An arm of a metre
would err by centimetres, a joint by eleven degrees."""
FALL = 3.0
"""Times that the gap must fall: what is wrong with a robot stays whatever is done to its table. The best of all
candidates brings 28 sound campaigns a factor of 1.0 to 1.5; faults of tables bring factors of ten to ten thousand."""
LEVEL = 1e-3
"""Chance, all candidates counted, that a search among them finds one as good in data without any fault."""
TIE = 3.0
"""Natural logarithms by which a candidate must be better than another one to be told from it: odds of 20."""
LEAST_GAP = 1e-6
"""m: a smaller gap is rounding of the table."""
NEARLY_ALL = 0.95
"""Of the rows: a fault that struck so many struck all; what few rows fit as they stand does so by chance."""
STRAY = 10.0
"""Times the median gap: rows beyond it stray. Of normal noise none is beyond 4, of heavy-tailed noise one in a
thousand."""
FEWEST_STRAYS, MOST_STRAYS = 3, 0.5
"""Rows that must stray, and the share of all above which the others no longer say where the robot stands."""
FEW_STRAYS, LEAST = 0.05, 0.01
"""Share of the rows that must stray at least; and the least gap, of a misfit, by which straying is counted: where noise
is all, a gross error of a few tenths of a millimetre is none of the pairing."""
MIXTURE_ROUNDS = 4
"""Rounds in which rows are told to be struck or not, and the frames fitted to both: they settle after three."""
PART_ROUNDS = 2
"""Times that the frames are fitted to the rows that do not stray: the first ones may be pulled by those that do."""
DRAWS, DRAWN = 300, 5
"""Draws of so many rows, from which frames are begun where half of the rows may be wrong: with five rows one draw in 32
is free of them, so that nine of 300 are; fewer rows do not determine two frames."""
NEAREST = 0.4
"""Share of the rows, nearest to the prediction, by which such a beginning is judged."""
SAMPLED, SKETCHED = 150, 40
"""Rows on which candidates are compared, spread evenly: a median is then known to a tenth; and those on which they are
first looked at."""
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
OFFSET_ROUNDS, OFFSET_SETTLED = 40, 1e-5
"""Steps at most in which an offset is refined, and the share of its bracket at which that ends."""
SEED = 13
"""Of the rows drawn at random: the same campaign always gets the same answer."""
MIXED_ROWS = 400
"""Rows up to which mixed readings are unmixed: the matrix is inverted."""
UNMIXED, MIXED_FLOOR = 1.0 - 1e-6, 1e-6
"""Of a row's own weight in what unmixing gives back: with less it is not determined; and the singular value of the
mixture, of its largest, below which nothing is given back: readings have six digits."""
TURN = math.pi
"""rad: a half turn, by which conventions of a joint's zero differ, or by half of it."""
STILL, MOST_BEHIND = 3.0, 0.1
"""Times the median gap within which measured places are one: the instrument alone scatters less, and two commands that
are far apart are never so near by chance. And the share of the rows up to which some that follow each other may be left
out as measured a command too early or too late: of more the table is to be paired anew."""
