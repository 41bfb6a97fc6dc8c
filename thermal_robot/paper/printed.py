"""The figures that the paper prints as results, and nothing else: no computation reads its answer from here.

Measurements and conditions that the paper prints are inputs and stand in :class:`~thermal_robot.paper.PaperInputs`. The
one result that serves as data again is the theoretical column of Table 1, from which the joints' σ are found.
"""

from thermal_robot.paper.entry import Printed

_MICRO = 1e-6

TABLE_1_THEORETICAL = Printed("16 17 17 / 21 16 16 µm", (16e-6, 17e-6, 17e-6, 21e-6, 16e-6, 16e-6), _MICRO)
TABLE_1_EXPERIMENTAL = Printed("14 18 17 / 23 16 18 µm", (14e-6, 18e-6, 17e-6, 23e-6, 16e-6, 18e-6), _MICRO)
TABLE_1_MINIMUM = Printed("−32 −54 −51 / −46 −48 −53 µm", (-32e-6, -54e-6, -51e-6, -46e-6, -48e-6, -53e-6), _MICRO)
TABLE_1_MAXIMUM = Printed("43 57 50 / 68 27 59 µm", (43e-6, 57e-6, 50e-6, 68e-6, 27e-6, 59e-6), _MICRO)
TABLE_1_SKEWNESS = Printed("0.067 0.287 0.075 / 0.225 −0.406 0.045", (0.067, 0.287, 0.075, 0.225, -0.406, 0.045), 0.001)
TABLE_2 = (
    Printed(".008 .014 .009 mm", (8e-6, 14e-6, 9e-6), _MICRO),
    Printed(".017 .003 .004 mm", (17e-6, 3e-6, 4e-6), _MICRO),
)
U_OF_EQ_13 = "outside the critical set"
U_BEFORE_STABILISATION = "in the critical set"
DELTA_L = "14 5 9 7 8 µm, averages"
FIGURE_ONLY = "figure only"
AREA_OF_EQ_18 = Printed("1, as a density", (1.0,), 1e-9)
EQ_19 = Printed("8.1e-5 mm", (8.1e-11,), 0.1e-11)
RATIO = Printed("0.5", (0.5,), 0.1)
EQ_20 = "value missing"
CRITICAL_W = Printed("0.964", (0.964,), 0.001)
NOT_REJECTED = "not rejected"
NORMAL_ENOUGH = "normal enough for r < 1"
CAPABILITY = (Printed("1.33", (1.33,), 0.01), Printed("1.00", (1.00,), 0.01))
LOWER = Printed("24.81 %", (0.2481,), 0.0001)
# C_p, its loss, and the growth of the clearance that makes up for it.
WARMED = (
    Printed("1.1; 17.8 %; +17.21 %", (1.1, 0.178, 0.1721), (0.1, 0.001, 0.0001)),
    Printed("1.17; 12 %; +12 %", (1.17, 0.12, 0.12), (0.01, 0.01, 0.01)),
)
_REQUIRED = Printed("1.33", (1.33,), 0.01)
LOSSES = (
    (_REQUIRED, Printed("1.1", (1.1,), 0.1), Printed("17.8 %", (0.178,), 0.001)),
    (_REQUIRED, Printed("1.17", (1.17,), 0.01), Printed("12 %", (0.12,), 0.01)),
    (_REQUIRED, Printed("1.00", (1.00,), 0.01), LOWER),
)
"""From and to which C_p, and the loss that is printed for it."""
Q3_OF_ROW_1 = (-1.3962, -1.3965)
"""rad, in Table 1 and in Table 2."""
QUANTILE_OF = "N(1,0)"
