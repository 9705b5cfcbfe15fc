"""Vision-based position control of driven cable robots: not started, nothing here yet."""
