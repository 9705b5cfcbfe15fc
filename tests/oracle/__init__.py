"""An independent simulator of cable-suspended platforms: truth for the tests and the benchmarks.

Written from mechanics alone (Newton-Euler in maximal coordinates, Lagrange multipliers) and from
MuJoCo; it shares no equation with the product's model, simulation or effects.
"""
