"""The public names for Python and notebooks, as `import freeswing as fs` gives them.

    session = fs.open("lab-day")
    found = session.identify()     # a table in a notebook; found.plot(), found.value("com_z_m")
    found.plot("residuals")        # of every run; also "spectra" and "correlation"
    found.to_dataframe()           # with pandas; found.to_arviz() with ArviZ
    lacking = session.diagnose()
    session.report()               # the page's path
    session.swing("swing-01")      # a recorded motion
    robot = fs.Robot.from_toml("lab-day/robot.toml")
    rest, modes = robot.equilibrium([1.38, 1.39, 1.36, 1.32])
    swing = robot.simulate([1.38, 1.39, 1.36, 1.32], amplitude_m=0.05)

The objects are those that the commands write and read: frozen dataclasses with types. What stands
in `__all__` here is public and follows semantic versioning; all else may change.
"""

from freeswing.cdpr.files.problems import DataError, InputError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Robot
from freeswing.front.found import Found
from freeswing.front.notebook import LabSession, open_lab
from freeswing.results.comparison import Comparison, compare, read_side
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import Identification

open = open_lab

__all__ = [
    "Comparison",
    "DataError",
    "Diagnosis",
    "Found",
    "Identification",
    "InputError",
    "LabSession",
    "Robot",
    "Trajectory",
    "compare",
    "open",
    "read_robot",
    "read_side",
]
