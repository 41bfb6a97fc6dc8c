"""What a robot looks like: the shapes of its URDF, as they are and as coarse hulls."""
