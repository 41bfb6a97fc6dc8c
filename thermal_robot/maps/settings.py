"""Numbers of the maps that were chosen, and why."""

CHUNK = 4096
"""Places, or configurations, that are worked on at once: their arrays take some ten megabytes."""
SEEDS = 12
"""Places of a chunk whose postures are searched from everywhere at a time; all others continue from neighbours."""
STARTS = 64
"""Configurations from which a posture is searched at a seed: one of eight postures that attracts a twentieth of all
starts is missed once in 27."""
IDLE = 3
"""Times in a row that seeds, taken where fewest postures are known, bring nothing new before the search ends: what one
in twenty places has is then overlooked in one map of six."""
MOST = 32
"""Postures that are kept of a place: sixteen is the most of six joints in general; redundant arms may have more."""
NEIGHBOURS = 9
"""From which a place is continued: those beside it in a plane, corners too."""
STEPS = 60
"""Of the search for one configuration."""
PULL = 0.5
"""Share of the way home that a step takes in directions that the task leaves free."""
LONGEST = 0.4
"""rad or m; of a step, so that a posture is not left."""
CLOSE = 1e-11
"""m and rad; a pose is reached."""
SETTLED = 1e-7
"""rad or m; the way home that is left where the free directions have settled."""
DAMPING = 1e-12
"""m² and rad²; beside the square of what is missing: keeps what nothing asks for out of the step."""
ALIKE = 1e-4
"""rad or m; two configurations of a place that differ by less are one."""
MOST_LINKS = 12
"""Segments whose 2^11 corners are compared for the width of a polygon."""
LISTED = 10
"""Best places that the command prints."""
