"""What a bench lacks: each candidate fitted in earnest beside the rest, judged on left-out runs."""
