"""What a platform was measured to do: trajectories, markers, shared errors of poses."""
