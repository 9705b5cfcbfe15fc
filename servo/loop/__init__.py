"""The control loop around the nonlinear robot: camera, controller, tensions, motors, friction."""
