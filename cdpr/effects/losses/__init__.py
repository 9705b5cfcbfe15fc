"""Effects that take energy: drag and friction."""
