"""Cameras tied by what the laboratory looks like: no board needed."""
