"""What the user writes and what the commands leave: weights, tasks, wrenches, controllers."""
