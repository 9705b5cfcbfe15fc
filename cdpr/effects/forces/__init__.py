"""Effects that push or pull, gravity's direction among them."""
