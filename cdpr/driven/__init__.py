"""The robot whose cables motors drive: actuators, springs, dynamics, linear model."""
