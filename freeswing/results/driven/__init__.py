"""Results of driven robots: what `drive.json` holds, and what makes it and their diagnosis."""
