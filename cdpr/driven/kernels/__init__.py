"""Loops over the samples of a driven robot's motion, compiled; the physics come in as addresses."""
