"""What stays constant: cameras and their clocks, base frame, start pose."""
