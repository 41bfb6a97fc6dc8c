"""Every number of a comparison that somebody chose, with its reason."""

from __future__ import annotations

MAY_BE = 0.1
"""Probability from which an effect that was found in no campaign is still compared: what each campaign is too short to
tell, several may."""
CHANGED = 0.8
"""Prior probability that an effect of a robot changed somewhere between campaigns: who compares has a reason to,
and what chance alone does is kept away by :data:`FALSE_CHANGE`."""
EVERYWHERE = 0.05
"""Part of the changes of an effect that are in all its places at once, as a new mastering of all joints is; a
collision, wear or a repair are in one."""
CHANGE_SPREAD = 2.0
"""Standard deviation of the logarithm of the size of a change, about that of the effect: a part of it, seldom more, and
nobody knows which; 95 % within a factor of fifty."""
FALSE_CHANGE = 0.02
"""Chance, all that was looked at counted, that two campaigns of a robot that did not change show any change."""
FEW = 5
"""Campaigns up to which every set of them may differ from the others (30 sets of five); of more, each alone, and those
before or after any moment."""
AT_ONCE = 500
"""Parts that are weighed together, each beside all others, and to first order at a time: a search over so many takes
seconds and a hundred megabytes; four campaigns of a real robot have 2800."""
AGREE = 0.5
"""Part of the larger of two sizes by which they may differ and still be one effect that changed, not two names for
something else: wear and re-adjustment move a size by a part of it, a wrong name takes any size."""
MOST = 0.5
"""Part of an effect's strength on which campaigns must agree for it to keep its name."""
HELD = 1e9
"""Degrees of freedom of the noise in a joint fit: each campaign has told its own, in units of which all is."""
TOLD = 1.0
"""Deviation, in expected sizes, from which a parameter is not compared: the data say no more than its size."""
SEEN = 1.0 - 1e-6
"""Part of a parameter's direction that the data must see for it to be compared: all but rounding."""
DISTINCT = 1e-3
"""Part of a parameter's column that must be left beside the parameters before it; less is the same thing twice."""
TWICE = 2.0
"""Stated deviations by which predictions of two campaigns may differ: beyond that the model is wrong, not the noise
(the cross-validation of mrcal)."""
POSES = 400
"""At most, of each campaign, at which predictions are compared: their root mean square is known to 4 %."""
SAME_PLACE = 1e-6
"""m and rad: two descriptions of one robot put its tool to the same place but for what a file rounds."""
TRIED = 8
"""Configurations at which two descriptions are compared: two robots that differ anywhere differ there."""
SAYS = 0.01
"""What a model's rows must say of a direction of its parameters, against what was expected beforehand, to count: frames
are held so loosely that of a zero which they take up a thousandth is left, and a hundredth tells nothing."""
ROUNDING = 1e-9
"""Part of the longest column below which one is rounding: a joint that turns the target about itself moves it by
1e-16 m, and a parameter that does anything at all by a millionth of another's."""
