"""A comparison as text: everything that it holds is told."""

from compared import diagnosed, moved

import thermal_robot as tr
from thermal_robot.report import comparison_headline, comparison_text


def test_the_text_tells_all_parts():
    found = tr.compare(diagnosed(1), diagnosed(3, moved(4e-4)), names=["before", "after"])
    plain = found.to_dict()
    said = comparison_text(plain)
    assert said.splitlines()[0] == comparison_headline(plain)
    for heading in ("CHANGED", "EFFECTS", "PARAMETERS", "PREDICTIONS", "NOT COMPARED"):
        assert heading in said
    assert "zero offset, joint_3" in said
    assert "before and after" in said
    quiet = comparison_text({**plain, "changes": [], "not_told": []})
    assert "  nothing\n" in quiet
    assert "NOT COMPARED" not in quiet
