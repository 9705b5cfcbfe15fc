"""Which swings to record: the plan with the lowest cost C, and how to let the platform go."""
