"""What is different where two wires alone carry a platform: it is free to roll."""
