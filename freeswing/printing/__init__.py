"""Boards and tags as files that print at their true size."""
