"""Sightings of all cameras to the platform's poses, with covariance."""
