"""One camera: its lens, where it stands, its file."""
