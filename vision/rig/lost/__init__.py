"""Frames that were lost while the stamps were counted on."""
