"""An independent simulator of cable-suspended platforms: truth for the tests and the benchmarks.

Written from mechanics alone (Newton-Euler in maximal coordinates, Lagrange multipliers) and from
MuJoCo; it shares no equation with the product's model, simulation or effects.

- `recorded`: session folders with undeclared effects and their sealed truth
  (`sessions.make_session`), the benchmark's list of them, how visible their effects are.
- `scenes`: robots, bodies, effects by name and size, rest poses and releases (`runs.draw_run`).
- `mechanics`: one free motion from a pose and a twist (`newton_euler.simulate`), rest poses.
- `witnesses`: the same motions by MuJoCo, the driven robot by its paper's equations.
"""
