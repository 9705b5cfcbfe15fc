"""Results and cameras in other programs' files."""
