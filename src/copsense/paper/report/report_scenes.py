"""report_scenes: the reproduction in 3-D, where viser is installed."""

from __future__ import annotations

import importlib.util

from copsense.explore.export import marks_words, played_views
from copsense.explore.film import client_notices, film_html
from copsense.explore.playback import frame_rows, sweep_run
from copsense.explore.played_model import PlayedModel
from copsense.paper.reproduce import Reproduction
from copsense.posture_run import PostureRun
from copsense.reports import ReportScene
from copsense.robots import load_stance

_RATE = 12.0  # frames a second


def report_scenes(reproduction: Reproduction) -> tuple[ReportScene, ...]:
    """The iCub leaning from foot to foot, as a film to turn and to scrub; nothing without viser."""
    if importlib.util.find_spec("viser") is None:
        return ()
    model = PlayedModel(lateral_run(reproduction))
    rows, seconds = frame_rows(model.run, _RATE)
    views = played_views(model, model.start, rows)
    return (
        ReportScene(
            "film",
            "overview",
            "The same in 3-D.",
            "Drag to turn it, scroll to come nearer; the bar plays and scrubs. Joints are coloured "
            f"by their torque under minimum torque. {marks_words(model.run)} Orange is minimum "
            "wrench, blue minimum torque.",
            film_html(views, seconds),
            client_notices(),
        ),
    )


def lateral_run(reproduction: Reproduction) -> PostureRun:
    """The postures of the lateral sweep on the iCub's stance."""
    return sweep_run(reproduction.lateral, load_stance("icub"))
