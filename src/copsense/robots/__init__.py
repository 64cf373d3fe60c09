"""Robots that copsense knows by name, and how any robot comes to stand."""

from copsense.robots.contact_soles import ContactGeometryWarning, sole_notes, soles_read
from copsense.robots.four_bar import four_bar_angles, four_bar_robot
from copsense.robots.inspection import Inspection, inspect_robot
from copsense.robots.plausibility import ImplausibleStanceWarning, heading_notes, plausibility_notes
from copsense.robots.presets import PRESETS, Preset
from copsense.robots.stance_file import StanceFile, save_stance, stance_data
from copsense.robots.standing import (
    StandingWarning,
    likely_feet,
    load_robot,
    load_stance,
    stand,
)
from copsense.robots.uprighting import UprightWarning

__all__ = [
    "PRESETS",
    "ContactGeometryWarning",
    "ImplausibleStanceWarning",
    "Inspection",
    "Preset",
    "StanceFile",
    "StandingWarning",
    "UprightWarning",
    "four_bar_angles",
    "four_bar_robot",
    "heading_notes",
    "inspect_robot",
    "likely_feet",
    "load_robot",
    "load_stance",
    "plausibility_notes",
    "save_stance",
    "sole_notes",
    "soles_read",
    "stance_data",
    "stand",
]
