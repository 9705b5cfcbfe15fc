"""Effects of measuring: the point and the clock that are not what they are taken for."""
