"""What each step of the demonstration is for, a sentence a step."""

LESSONS = {
    "calibrate": "a board that all cameras saw at once tells their lenses, places and clocks; four "
    "surveyed tags on the wall tie them to the robot's frame",
    "track": "the tags' corners, found to hundredths of a pixel, become the platform's pose in "
    "every frame, each with its own uncertainty",
    "identify": "with locked cables the platform swings as its mass is spread: from how it moves "
    "follow its centre of mass and inertia, all runs in one fit",
    "diagnose": "runs that were never fitted are predicted; what the prediction leaves is held "
    "against everything that a robot may hide, geometry before forces",
}
