"""Commands on a robot file: what it does, where it starts, what to record."""
