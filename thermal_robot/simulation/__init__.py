"""A campaign whose truth is known: a robot with effects of stated size, measured by an instrument of stated noise."""
