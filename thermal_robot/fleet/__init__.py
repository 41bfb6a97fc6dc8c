"""Several campaigns: comparison, change over time, fleets of robots."""
