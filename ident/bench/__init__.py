"""Anything that hangs: runs that measure less than a pose, channels, loads, known masses."""
