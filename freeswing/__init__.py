"""The front door: session files, commands and the report."""

__version__ = "0.1.0"
