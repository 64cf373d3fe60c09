"""Limit result: how the postures of a batch stand to their limits, in arrays, the posture first."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

from copsense.batch.statics.limit_states import IMPOSSIBLE, LIMIT_STATES, UNANSWERED, UNLOADED
from copsense.errors import InfeasibleError, UnloadedContactError
from copsense.limits import Limits, limit_rows
from copsense.listing import counted
from copsense.load_problem import LoadProblem
from copsense.margins import MarginTable
from copsense.stance import Stance
from copsense.statics import ActiveLimit, ActiveSetChange


@dataclass(frozen=True, eq=False)
class LimitResult:
    """How N postures stand to their limits under nk criteria.

    Attributes:
        limits: what was asked of wrenches and torques.
        criteria: names of the criteria.
        names: what each row of the limits is (r,), such as ``"torque of l_knee"``.
        kinds: of the rows (r,), as of `ActiveLimit`.
        margin_names: contact or joint, and kind, of each margin (g,).
        state: 0 where the criterion's own wrenches are within the limits; 1 where limits press; 2
            where no wrench respects them; 3 where a contact is left without load, and has no centre
            of pressure; 4 where there is no answer for another reason. See `states`.
        pressing: index of the rows that press, -1 where there are fewer.
        multipliers: how hard they do, 0 where there are fewer; as `ActiveLimit.multiplier`.
        touching: number of rows on their bounds that do not press. Where what presses leaves one
            of them free to move, the sensitivities to the two sides differ.
        optimality: largest violation of an optimality condition, recomputed from the results,
            as `ConstrainedEquilibrium.optimality`; 0 where nothing presses.
        margins: smallest distance to the limits of each contact or joint and kind, in its own unit.
        own_margins: the same of the wrenches that the criterion chooses without limits.
        relaxation: least amount by which every limit would have to be relaxed where no wrench
            respects them [N, Nm]; 0 elsewhere.
        conflict: index of the rows that demand it, -1 where there are fewer.
        unloaded: a bit for each contact without load where one has none.
        change_travel: how far the CoM may travel to first order, whichever way, before a limit
            begins or ceases to press [m]; infinite where none will, NaN where there is no answer or
            a tie-break alone presses; empty where gains were not asked for.
        change_limit: index of the row that does; -1 for none. See `nearest_change`.
    """

    limits: Limits
    criteria: tuple[str, ...]
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    margin_names: tuple[tuple[str, str], ...]
    state: UInt8[np.ndarray, "N nk"]
    pressing: Int[np.ndarray, "N nk p"]
    multipliers: Float[np.ndarray, "N nk p"]
    touching: Int[np.ndarray, "N nk"]
    optimality: Float[np.ndarray, "N nk"]
    margins: Float[np.ndarray, "N nk g"]
    own_margins: Float[np.ndarray, "N nk g"]
    relaxation: Float[np.ndarray, " N"]
    conflict: Int[np.ndarray, "N c"]
    unloaded: UInt8[np.ndarray, "N nk"]
    change_travel: Float[np.ndarray, "G nk"]
    change_limit: Int[np.ndarray, "G nk"]

    def __repr__(self) -> str:
        """How many answers are in each state."""
        counts = np.bincount(self.state.ravel(), minlength=len(LIMIT_STATES))
        words = ", ".join(f"{n} {w}" for n, w in zip(counts, LIMIT_STATES, strict=True) if n)
        return f"LimitResult({counted(len(self.names), 'row')}; {words or 'nothing evaluated'})"

    @property
    def states(self) -> tuple[str, ...]:
        """What each code of `state` says."""
        return LIMIT_STATES

    def active(self, posture: int, criterion: int) -> tuple[ActiveLimit, ...]:
        """The limits that press at a posture under a criterion, the hardest pressed first."""
        rows, how = self.pressing[posture, criterion], self.multipliers[posture, criterion]
        found = [
            ActiveLimit(self.names[i], self.kinds[i], float(l))
            for i, l in zip(rows, how, strict=True)
            if i >= 0
        ]
        return tuple(sorted(found, key=lambda limit: -limit.multiplier))

    def nearest_change(self, posture: int, criterion: int) -> ActiveSetChange | None:
        """The change of the pressing limits that the CoM meets first, whichever way it goes.

        As `CopSensitivity.nearest_active_set_change`. None where there is no change, and where
        there is no answer or gains were not asked for.
        """
        if not len(self.change_limit) or self.change_limit[posture, criterion] < 0:
            return None
        i, travel = self.change_limit[posture, criterion], self.change_travel[posture, criterion]
        name = self.criteria[criterion]
        binds = i not in self.pressing[posture, criterion]
        return ActiveSetChange(name, self.names[i], self.kinds[i], binds, float(travel))

    def reason(self, posture: int, criterion: int, contacts: tuple[str, ...]) -> str:
        """Why a posture has no answer under a criterion; empty where another reason may hold."""
        state = self.state[posture, criterion]
        if state == IMPOSSIBLE:
            rows = sorted(i for i in self.conflict[posture] if i >= 0)
            demands = dict.fromkeys(self.names[i] for i in rows)
            return str(InfeasibleError(float(self.relaxation[posture]), tuple(demands)))
        if state == UNLOADED:
            bits = int(self.unloaded[posture, criterion])
            without = tuple(name for k, name in enumerate(contacts) if bits >> k & 1)
            return str(UnloadedContactError(without))
        return ""


def limit_arrays(result: LimitResult) -> dict[str, np.ndarray]:
    """Its arrays by name."""
    named = ("limits", "criteria", "names", "kinds", "margin_names")
    return {f.name: getattr(result, f.name) for f in fields(result) if f.name not in named}


_EMPTY = {"state": UNANSWERED, "pressing": -1, "conflict": -1, "change_limit": -1}
_NUMBERS = ("optimality", "margins", "own_margins", "change_travel")
CHANGES = ("change_travel", "change_limit")
"""Arrays that a batch fills only where it is asked for gains."""


def limit_template(stance: Stance, limits: Limits, criteria: tuple[str, ...]) -> LimitResult:
    """A result of no posture."""
    rows = limit_rows(stance, limits)
    table = MarginTable(stance.contacts, rows)
    load = LoadProblem.of(stance)
    # As many rows can press as the balance leaves forces.
    free = max(load.base_map.shape[1] - int(np.linalg.matrix_rank(load.base_map)), 1)
    each, groups = (0, len(criteria)), len(table.groups)
    arrays: dict[str, Any] = {
        "state": np.zeros(each, dtype=np.uint8),
        "pressing": np.zeros((*each, free), dtype=np.int64),
        "multipliers": np.zeros((*each, free)),
        "touching": np.zeros(each, dtype=np.int64),
        "optimality": np.zeros(each),
        "margins": np.zeros((*each, groups)),
        "own_margins": np.zeros((*each, groups)),
        "relaxation": np.zeros(0),
        "conflict": np.zeros((0, free + 1), dtype=np.int64),
        "unloaded": np.zeros(each, dtype=np.uint8),
        "change_travel": np.zeros(each),
        "change_limit": np.zeros(each, dtype=np.int64),
    }
    first = [int(members[0]) for members in table.groups]
    return LimitResult(
        limits,
        criteria,
        rows.all_names,
        rows.all_kinds,
        tuple((table.where[i], table.kinds[i]) for i in first),
        **arrays,
    )


def empty_limits(template: LimitResult, count: int, *, gains: bool) -> LimitResult:
    """A result of so many postures, to be filled."""
    arrays: dict[str, Any] = {}
    for name, array in limit_arrays(template).items():
        nothing = np.nan if name in _NUMBERS else _EMPTY.get(name, 0)
        rows = count if gains or name not in CHANGES else 0
        arrays[name] = np.full((rows, *array.shape[1:]), nothing, dtype=array.dtype)
    return replace(template, **arrays)
