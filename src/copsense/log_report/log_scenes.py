"""log_scenes: a log's report in 3-D, where viser is installed."""

from __future__ import annotations

import importlib.util

from copsense.explore.export import marks_words, played_views
from copsense.explore.film import client_notices, film_html
from copsense.explore.playback import frame_rows, run_seconds
from copsense.explore.played_model import PlayedModel
from copsense.logs import LogComparison
from copsense.reports import ReportScene

_FRAMES, _RATE = 150, 10.0  # at most of a film, and of a second of it


def draw_log_scenes(comparison: LogComparison, prefix: str = "log") -> tuple[ReportScene, ...]:
    """The log as a film in 3-D under the paper's two criteria; nothing without viser.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        prefix: of its name, and its section.
    """
    if importlib.util.find_spec("viser") is None:
        return ()
    model = PlayedModel(comparison.run)
    seconds = max(run_seconds(model.run), 1e-3)
    rows, step = frame_rows(model.run, min(_RATE, _FRAMES / seconds))
    views = played_views(model, model.start, rows)
    return (
        ReportScene(
            f"{prefix}_film",
            prefix,
            "The log, played.",
            f"{len(rows)} of the {len(model.run)} postures that were compared. "
            f"{marks_words(model.run)}",
            film_html(views, step),
            client_notices(),
        ),
    )
