"""All cameras together: views, bundle adjustment and its start."""
