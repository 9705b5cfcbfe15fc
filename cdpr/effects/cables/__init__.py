"""Effects of the cables themselves: they stretch, weigh something, or slip at the winch."""
