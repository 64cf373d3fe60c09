"""Robots that copsense knows by name, and how any robot comes to stand."""

from copsense.robots.four_bar import four_bar_angles, four_bar_robot
from copsense.robots.presets import PRESETS, Preset
from copsense.robots.stance_file import StanceFile, save_stance
from copsense.robots.standing import (
    ContactGeometryWarning,
    likely_feet,
    load_robot,
    load_stance,
    sole_notes,
    stand,
)

__all__ = [
    "PRESETS",
    "ContactGeometryWarning",
    "Preset",
    "StanceFile",
    "four_bar_angles",
    "four_bar_robot",
    "likely_feet",
    "load_robot",
    "load_stance",
    "save_stance",
    "sole_notes",
    "stand",
]
