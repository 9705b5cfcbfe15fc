"""A recorded session made from a seed, with an effect that its files do not declare."""
