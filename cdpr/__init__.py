"""The robot on paper: frames, trajectory, cables, free motion, dynamics, effects, simulation."""
