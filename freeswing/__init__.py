"""The front door: session files, commands and the report."""
