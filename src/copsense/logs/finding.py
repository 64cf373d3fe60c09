"""Finding: what is wrong or missing in a log, named and dated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True)
class Finding:
    """One thing that a log lacks or gets wrong.

    Attributes:
        kind: ``"gap"``, ``"clock"``, ``"missing"``, ``"dead sensor"``, ``"unloaded"``, ``"total"``,
            ``"sign"``, ``"offset"``, ``"slip"``, ``"base"``, ``"com"`` or ``"joint"``.
        about: the sensor, joint or contact concerned.
        message: a sentence or two: what was found, what was done, what may help.
        start: first time concerned [s, from the log's first sample]; None for the whole log.
        stop: last time concerned [s].
    """

    kind: str
    about: str
    message: str
    start: float | None = None
    stop: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "kind": self.kind,
            "about": self.about,
            "message": self.message,
            "start": self.start,
            "stop": self.stop,
        }


def stretches(flags: Bool[np.ndarray, " N"]) -> list[tuple[int, int]]:
    """First and last index of each run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def dated(
    kind: str,
    about: str,
    message: str,
    flags: Bool[np.ndarray, " N"],
    times: Float[np.ndarray, " N"],
) -> Finding | None:
    """One finding for all flagged rows: ``{where}`` in the message becomes their stretches.

    None where no row is flagged.
    """
    runs = stretches(flags)
    if not runs:
        return None
    shown = [f"{times[a]:.3g} to {times[b]:.3g} s" for a, b in runs[:3]]
    if len(runs) > 3:
        shown.append(f"{len(runs) - 3} more stretches")
    if flags.all():
        shown = ["the whole log"]
    return Finding(
        kind,
        about,
        message.format(where=", ".join(shown), rows=int(flags.sum())),
        float(times[runs[0][0]]),
        float(times[runs[-1][1]]),
    )
