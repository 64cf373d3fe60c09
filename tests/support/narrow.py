"""Cases that are over in a second: an iCub on soles so narrow that it soon tips."""

from copsense.comparison import (
    ControllerChoice,
    Lean,
    PostureChoice,
    Rest,
    RobotChoice,
    make_plan,
)

ROBOT = RobotChoice(
    "icub",
    "narrow",
    soles={"l_sole": (-0.05, 0.1, -0.01, 0.03), "r_sole": (-0.05, 0.1, -0.03, 0.01)},
)
FULL = RobotChoice(
    "icub",
    soles={
        "l_sole": (-0.0535, 0.1065, -0.031, 0.041),
        "r_sole": (-0.0535, 0.1065, -0.041, 0.031),
    },
    sole_height=-0.0105,
)
STRAIGHT = PostureChoice("straight", knees=0.0)
C1, C2 = ControllerChoice("minimum-wrench"), ControllerChoice("minimum-torque")
LEAN, REST = Lean(0.015, 0.02), Rest(0.1)


def plan(trials=(LEAN, REST), controllers=(C1, C2)):
    """Two controllers, two trials: four cases."""
    return make_plan([ROBOT], [STRAIGHT], controllers, trials)


def one(trial, controller=C1, robot=ROBOT, **options):
    """A single case."""
    (case,) = make_plan([robot], [STRAIGHT], [controller], [trial], **options)
    return case
