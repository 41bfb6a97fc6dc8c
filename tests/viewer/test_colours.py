"""Colours of places: ordered by share, from grey to full."""

import numpy as np

from thermal_robot.viewer.settings import FULL_SHARE, NO_SHARE, between, colours, linear


def brightness(colour):
    """Relative luminance, ITU-R BT.709, of colours as they are stored."""
    return np.dot([0.2126, 0.7152, 0.0722], colour)


def test_colours_are_ordered_by_share():
    shares = {("joint", f"j{k}"): share for k, share in enumerate([0.61, 0.2, 0.12, 0.05, 0.02, 0.0])}
    found = colours(shares)
    bright = [brightness(found[place]) for place in shares]
    assert (np.diff(bright) > 0.0).all()  # the larger the share the darker, for those too who see no colours
    assert found["joint", "j0"] == FULL_SHARE
    assert found["joint", "j5"] == NO_SHARE


def test_where_no_place_matters_all_are_pale():
    pale = colours({("link", "a"): 0.01, ("link", "b"): 0.002})
    assert min(map(brightness, pale.values())) > 0.5 * (brightness(NO_SHARE) + brightness(FULL_SHARE))
    assert colours({}) == {}


def test_a_colour_is_one_whatever_the_share():
    for part in (-1.0, 0.0, 0.5, 1.0, 7.0):
        assert all(0 <= value <= 255 for value in between(part))


def test_half_the_light_is_more_than_half_of_what_a_screen_takes():
    """Printed pairs of sRGB: 188 is half the light, 118 is 18 %, the grey card of photographers."""
    assert linear([0, 255, 188]).tolist() == [0, 255, 128]
    assert linear([118]).item() == round(0.18 * 255)
    every = linear(np.arange(256)).astype(int)
    assert (np.diff(every) >= 0).all()
