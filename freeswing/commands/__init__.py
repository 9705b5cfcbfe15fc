"""One small file a command: its flags, and a `run` that loads, calls one pure function and saves."""
