"""An independent simulator of cable-suspended platforms: truth for the tests and the benchmarks.

Written from mechanics alone (Newton-Euler in maximal coordinates, Lagrange multipliers) and from
MuJoCo; it shares no equation with the product's model, simulation or effects.

- `sessions.make_session`: a session folder with undeclared effects and its sealed truth.
- `cases.manifest`: the benchmark's list of such sessions; `visibility.visibility`: how visible.
- `newton_euler.simulate`, `mujoco_swing.mujoco_swing`: one free motion from a pose and a twist.
- `equilibrium.settle`, `runs.draw_run`: rest poses, releases, runs with all cables taut.

Compiled functions are cached beside the files. The cache of a caller does not notice a change in
another file that it compiled in: delete `__pycache__` after editing compiled functions.
"""
