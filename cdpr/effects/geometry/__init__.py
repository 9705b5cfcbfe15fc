"""Effects of geometry: cable ends, pulleys and lengths that are not as declared."""
