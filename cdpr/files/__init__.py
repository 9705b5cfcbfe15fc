"""The project's files: robot.toml, trajectories, meshes; documents read and written whole."""
