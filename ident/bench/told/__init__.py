"""What a bench fit says of each body, of the classic formula and of held-out runs."""
