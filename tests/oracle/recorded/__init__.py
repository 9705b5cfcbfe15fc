"""What a user would have recorded: sessions, days in a laboratory, benches, and the sealed list."""
