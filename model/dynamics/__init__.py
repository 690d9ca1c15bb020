"""Bodies in motion: time integrators with exact contact at the end of each step."""
