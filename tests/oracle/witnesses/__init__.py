"""Motions by others: MuJoCo, and the driven robot's equations as its paper prints them."""
