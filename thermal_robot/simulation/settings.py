"""Every number that was chosen for when rows are measured, in a campaign that is simulated or planned."""

ROWS = 60
"""Rows of a campaign of which nobody says how long it is: an hour's work, as :data:`SECONDS_A_ROW` has it."""
SECONDS_A_ROW = 60.0
"""s: an arm moves, settles and is measured in less; slower, so that the arm warms while it is measured."""
COLD, RISE = 20.0, 6.0
"""°C at the start, the temperature to which lengths refer; and K by which an arm at work warms in an hour or two."""
WARMING, CONSTANT = 0.6, 0.2
"""Shares of the campaign: how long the arm warms, before it cools; and the time constant of either."""
BLOCKS = 3
"""How often each payload comes round: so it is not confounded with time, and nobody changes it at each pose."""
SWAPS = 3000
"""Exchanges of two poses that are tried to balance an order."""
BALANCED = 0.1
"""Share by which the approaches from one side may differ from half in an order that is taken as balanced."""
