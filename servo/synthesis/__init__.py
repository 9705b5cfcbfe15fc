"""Controllers from plants and weights: H-infinity by two Riccati equations, and their judgement."""
