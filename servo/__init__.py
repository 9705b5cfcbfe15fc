"""Vision-based position control of driven cable robots (not started: see DESIGN in docs)."""
