"""A campaign in three dimensions: the robot in each of its poses, and the gap there; served to the browser."""
