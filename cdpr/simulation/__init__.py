"""Motions of a model: integrated, with their sensitivities, and the states they start from."""
