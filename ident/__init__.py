"""Trajectory in; inertial parameters, validation and missing effects out."""
