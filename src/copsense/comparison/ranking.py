"""Ranking of controllers by their scores, and agreement of the predictions with physics."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas as pd

from copsense.comparison.score_kinds import SCORES
from copsense.json_data import json_data

CAVEAT = (
    "Prediction and controller use the same criterion to share the load: the agreement compares "
    "theory with physics, and does not apply to controllers that share the load in another way."
)
"""A note to show with every agreement."""

_SETTING = ["robot", "posture", "conditions", "trial", "score"]
_SAME = 1e-9  # relative spread below which values are taken as one
# Scores with a prediction to compare; the others have none, or one of zero.
_COMPARED = (
    "tip_excursion",
    "tip_impulse",
    "smallest_margin",
    "torque_norm",
    "torque_peak",
    "breaking_torque_limit",
)


def rank_scores(table: pd.DataFrame) -> pd.DataFrame:
    """The controllers' ranks in each setting (robot, posture, conditions, trial) and score.

    A controller's rank is 1 plus the number of controllers that are clearly better, whose interval
    lies wholly beyond its own; within their resolution controllers share a rank. A run that failed
    or tipped too early ranks last. A setting in which every run did, or nothing can be measured, is
    left out.

    Returns:
        The ranked rows of the table with ``rank`` and ``of``, the number of controllers in the
        setting.
    """
    known = ~table["status"].isin(["failed", "tipped", "none"])
    some = known.groupby([table[name] for name in _SETTING]).transform("any")
    ranked = table[some & (table["status"] != "none")].copy()
    ranked["rank"], ranked["of"] = 1, 1
    for (*_, score), rows in ranked.groupby(_SETTING, sort=False):
        larger = SCORES[str(score)].larger
        failed = rows["status"].isin(["failed", "tipped"]).to_numpy()
        # Better is larger from here on.
        low = (rows["low"] if larger else -rows["high"]).to_numpy()
        high = (rows["high"] if larger else -rows["low"]).to_numpy()
        low, high = np.where(failed, -np.inf, low), np.where(failed, -np.inf, high)
        beaten = (low[None, :] > high[:, None]) | (failed[:, None] & ~failed[None, :])
        ranked.loc[rows.index, "rank"] = 1 + beaten.sum(axis=1)
        ranked.loc[rows.index, "of"] = len(rows)
    return ranked


def rank_controllers(table: pd.DataFrame) -> pd.DataFrame:
    """How the controllers compare in each trial's scores, over all settings.

    Only settings in which every controller of the trial was tried count, if there is one.

    Returns:
        A row for each trial, score and controller, the best first, with ``mean_rank``, ``wins``
        (settings in which no controller is better), ``settings``, ``failures`` (of these, failed or
        tipped), and ``mean`` of the values (NaN if one was not measured).
    """
    ranked, rows = rank_scores(table), []
    for (trial, score), group in ranked.groupby(["trial", "score"], sort=False):
        most = group["of"].max()
        shared = group[group["of"] == most]
        for controller, own in shared.groupby("controller", sort=False):
            measured = (own["status"] == "measured").all()
            rows.append(
                {
                    "trial": trial,
                    "score": score,
                    "unit": SCORES[str(score)].unit,
                    "controller": controller,
                    "mean_rank": float(own["rank"].mean()),
                    "wins": int((own["rank"] == 1).sum()),
                    "settings": len(own),
                    "failures": int(own["status"].isin(["failed", "tipped"]).sum()),
                    "mean": float(own["value"].mean()) if measured else np.nan,
                }
            )
    columns = ["trial", "score", "unit", "controller", "mean_rank", "wins", "settings"]
    found = pd.DataFrame(rows, columns=[*columns, "failures", "mean"])
    keys = list(zip(found["trial"], found["score"], strict=True))
    order = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    found["_order"] = [order[key] for key in keys]
    found = found.sort_values(["_order", "mean_rank"], kind="stable")
    return found.drop(columns="_order").reset_index(drop=True)


def _is_users(parameters: str) -> bool:
    """Whether a case's controller is a user's own."""
    return bool(parameters and json.loads(parameters)["controller"].get("source"))


def agreement(table: pd.DataFrame) -> pd.DataFrame:
    """How well the predictions hold, over the rows that were measured. See `CAVEAT`.

    Users' own controllers are left out: the prediction only assumes their criterion.

    Returns:
        A row per score and prediction (``"path"``, exact, or ``"first order"``): ``cases``, mean
        and largest absolute error in the score's unit, Pearson's ``correlation`` with the ends
        ``low`` and ``high`` of its 95 % interval (Fisher's z; NaN under four cases).
    """
    rows, table = [], table[~table["parameters"].map(_is_users)]
    for score in _COMPARED:
        of_score = table[(table["score"] == score) & (table["status"] == "measured")]
        for prediction, column in (("path", "predicted"), ("first order", "first_order")):
            known = of_score[np.isfinite(of_score[column].astype(float))]
            if not len(known):
                continue
            x, y = known[column].to_numpy(float), known["value"].to_numpy(float)
            error = np.abs(y - x)
            r, low, high = _correlation(x, y)
            rows.append(
                {
                    "score": score,
                    "unit": SCORES[score].unit,
                    "prediction": prediction,
                    "cases": len(known),
                    "mean_error": float(error.mean()),
                    "largest_error": float(error.max()),
                    "correlation": r,
                    "low": low,
                    "high": high,
                }
            )
    columns = ["score", "unit", "prediction", "cases", "mean_error", "largest_error"]
    return pd.DataFrame(rows, columns=[*columns, "correlation", "low", "high"])


def benchmark_summary(table: pd.DataFrame) -> dict[str, Any]:
    """What ``copsense benchmark --json`` prints of a table, as plain data.

    Returns:
        ``cases`` and how many of them ``failed``, and as lists of rows ``scores``, ``ranking``
        (`rank_controllers`) and ``agreement``, with its ``caveat``; None for what is not a number.
    """
    rows = {
        "scores": table.drop(columns="parameters"),
        "ranking": rank_controllers(table),
        "agreement": agreement(table),
    }
    data: dict[str, Any] = {
        "cases": int(table["key"].nunique()),
        "failed": int(table[table["status"] == "failed"]["key"].nunique()),
        **{name: part.to_dict("records") for name, part in rows.items()},
        "caveat": CAVEAT,
    }
    return dict(json_data(data))


def _correlation(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Pearson's r and the ends of its 95 % interval; NaN for too few values, or one repeated."""
    from scipy.stats import pearsonr

    r = low = high = np.nan
    if len(x) > 2 and all(np.ptp(values) > _SAME * np.abs(values).max() for values in (x, y)):
        found = pearsonr(x, y)
        r = float(found.statistic)
        if len(x) > 3:  # Fisher's z has 1 / sqrt(n - 3)
            low, high = map(float, found.confidence_interval(0.95))
    return r, low, high
