"""A session begun: its files with comments, and the numbers that are still missing marked."""
