"""What the motors, springs, drums and the platform of a driven robot may hide."""
