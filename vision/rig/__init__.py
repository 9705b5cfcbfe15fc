"""What is wrong with the rig during a run: late clocks, moved cameras, rolling shutters."""
