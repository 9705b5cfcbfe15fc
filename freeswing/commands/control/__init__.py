"""Commands for the driven robot under control."""
