"""The calibration board: its numbers, its corners in images and its motion."""
