"""One small file a command: its flags, and a `run` that loads, calls one function and saves."""
