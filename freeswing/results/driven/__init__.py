"""Results of driven robots: drive.json, its curves, and what makes them and their diagnosis."""
