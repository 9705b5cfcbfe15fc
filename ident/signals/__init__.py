"""Recorded samples to positions, velocities and accelerations on common stamps."""
