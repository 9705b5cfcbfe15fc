"""How the platform moves between the instants whose poses are looked for."""
