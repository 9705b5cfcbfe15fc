"""The project's files: robot.toml, trajectories, documents read and written whole."""
