"""Which currents and poses at rest tell most about a driven robot, before anything is recorded."""
