"""What the markers of a session are worth: labels, one layout, each by itself, poses."""
