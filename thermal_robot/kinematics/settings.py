"""Chosen numbers of the batch engines, each with its unit and reason."""

CHUNK = 2048
"""Configurations worked on at a time: few enough for the frames of an arm to stay in a core's own cache (100 kB an
element), many enough for NumPy's calls to cost little beside them."""
CACHE = 1_000_000
"""Bytes that the frames of a chunk may take; a long chain is worked on in shorter chunks."""
SHORTEST_CHUNK = 64
"""Configurations; with fewer, NumPy's calls cost more than what they work on."""
FEW = 80
"""Configurations up to which Pinocchio itself is called for each: for fewer, NumPy's calls alone take longer (50 for
poses, 100 for Jacobians and torques)."""
MOST_PLACEMENTS = 40
"""Segments of a chain that Pinocchio is called for: its memory grows with their cube, 9 MB at 40."""
LANES = 256
"""Configurations side by side in the inner loops of the compiled kernels: long rows for the memory that results are
written to, and few enough for the frames of an arm to stay in a core's own cache. On a UR5 poses and Jacobians take
15 % longer with 128 or 512, sensitivities 13 % longer with 128."""
LARGEST_REDUCED = 1e6
"""rad; the sine of a larger angle is left to the library, for the reduction to ±π/4 would lose digits."""
MANY = 20_000
"""Configurations from which the compiled kernels are used: the first call loads numba, which takes a second, and
compiles, which takes a minute at most and is kept on disk. NumPy has done fewer in a hundredth of a second."""
LOAD_STEP = 0.02
"""rad along the way: loads are linear between configurations so near, to 5e-5 of themselves."""
