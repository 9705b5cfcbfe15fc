"""Cables that stretch, as the springs that they are."""
