"""Maximum likelihood over the free motions themselves."""
