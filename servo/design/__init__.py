"""Controllers of one robot, each from its linear model, tuned by one rule and held against it."""
