"""What recordings of a driven robot hold: mistakes, slack cables, ramps."""
