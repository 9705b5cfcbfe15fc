"""What tracking saw, shown: overlay videos and a viewer."""
