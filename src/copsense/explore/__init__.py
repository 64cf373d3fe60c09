"""The explorer: states of a robot, what is seen of them, and a window in the browser.

A `State` says what is asked for and writes it as a command and as Python; a `Model` answers it with
a `View`, plain data with the numbers of `copsense.analyse`. Neither knows a window. ``copsense
explore`` shows them in the browser (`copsense.explore.server`, the extra ``explore``); `show` makes
a page of a result, which notebooks show.
"""

from copsense.explore.model import Model
from copsense.explore.movable import Coordinate
from copsense.explore.showing import ShownPage, show
from copsense.explore.state import Setting, State
from copsense.explore.view import CriterionView, RegionView, View

__all__ = [
    "Coordinate",
    "CriterionView",
    "Model",
    "RegionView",
    "Setting",
    "ShownPage",
    "State",
    "View",
    "show",
]
