"""The names for Python and notebooks, as `import freeswing as fs` gives them.

    session = fs.open("lab-day")
    found = session.identify()     # a table in a notebook; found.plot(), found.value("com_z_m")
    lacking = session.diagnose()
    session.report()               # the page's path
    robot = fs.read_robot("lab-day/robot.toml")

The objects are those that the commands write and read, `freeswing.results`; versions of what is
named here follow semantic versioning.
"""

from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.robot import Robot
from freeswing.front.found import Found
from freeswing.front.notebook import LabSession, open_lab
from freeswing.results.comparison import Comparison, compare, read_side
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import Identification

open = open_lab

__all__ = [
    "Comparison",
    "Diagnosis",
    "Found",
    "Identification",
    "LabSession",
    "Robot",
    "compare",
    "open",
    "read_robot",
    "read_side",
]
