"""Three-dimensional view of a campaign in the browser: robot, poses, gap."""
