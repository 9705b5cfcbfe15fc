"""Footage: when its frames were taken, and what is wrong with the pictures themselves."""
