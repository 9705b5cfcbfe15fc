"""Recordings with known truth, rendered."""
