"""Printed square tags: their cells, and their corners to a hundredth of a pixel."""
