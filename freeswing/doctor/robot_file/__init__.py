"""What is wrong in a robot file: by itself, and by the recordings."""
