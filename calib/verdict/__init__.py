"""May this calibration be used? Checks against surveys, plumb lines and truth."""
