"""Recorded frames in, trajectory with covariance out."""
