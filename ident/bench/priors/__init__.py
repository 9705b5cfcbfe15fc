"""What is known of a bench before any of its runs: bodies, wires, motions, channels."""
