"""Processes and clusters that share the work."""
