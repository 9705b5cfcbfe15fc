"""One camera from above: a platform's motion in its own plane."""
