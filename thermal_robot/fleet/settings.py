"""Every number of this room that somebody chose, with its reason."""

UNHELD = 1e4
"""Prior deviation, in expected sizes, of an effect whose parameters are to be told by the data alone: next to none,
while the equations can still be solved."""
SEEN = 1.0 - 1e-6
"""Share of a parameter's direction that the data must see for it to have a value: all but rounding."""
MAY_BE = 0.1
"""Probability from which an effect that was not found may still be at work, beside another whose size is told. With 40
arms that warm by less than can be found in half of them, a joint's zero was off by 4.5 of its deviations over the fleet
without this, by 3.4 at 0.3, by less than 3 at 0.1; below that deviations grow, and nothing gets better."""
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
LEAST_HEARD = 1e-6
"""Weight of a robot that is surely unlike the others: of a group in which all are unlike each other there is a mean."""
UNLIKE_PRIOR = (0.5, 20.0)
"""What is known of their share beforehand, in robots unlike and like: rare, and learned from a fleet of twenty."""
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
ASKED_EVERY = 2.0
"""Seconds after which a scheduler is asked again how many threads it has: workers come within minutes, and go."""
