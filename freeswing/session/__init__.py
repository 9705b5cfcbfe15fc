"""A user's session: its file, its recordings, the stages that are out of date."""
