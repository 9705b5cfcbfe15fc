"""One self-contained page that shows a session's results."""
