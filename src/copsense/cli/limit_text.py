"""What `copsense analyse` says of limits: which are active, how far each is, and the regions."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import click

from copsense.errors import CopsenseError

if TYPE_CHECKING:
    from copsense.criterion import Criterion
    from copsense.limits import Limits
    from copsense.scan import PathScan
    from copsense.sensitivity import CopSensitivity
    from copsense.stance import Stance
    from copsense.statics import ActiveSetChange

_REACH, _POSTURES = 0.05, 21  # of the CoM's path that is drawn with the regions [m]


def add_limits(
    answer: dict[str, Any],
    stance: Stance,
    criteria: list[Criterion],
    results: dict[str, CopSensitivity],
    limits: Limits,
    tangent: Any,
) -> None:
    """Active limits, margins, the CoM's travel to each limit and to the next change of the active.

    The changes are along the path's tangent, to either side, first order and exact.
    """
    from copsense.limits import torque_placeholders
    from copsense.margins import limit_margins
    from copsense.path import LateralPath
    from copsense.scan import PathScan
    from copsense.statics import ConstrainedEquilibrium

    if limits.torque == "model" and torque_placeholders(stance):
        answer.setdefault("notes", []).append(
            "no torque limit in the model (a placeholder) for: "
            + ", ".join(torque_placeholders(stance))
        )
    path = LateralPath(stance)  # its postures serve every criterion and question
    for criterion in criteria:
        row, equilibrium = answer["criteria"][criterion.name], results[criterion.name].equilibrium
        assert isinstance(equilibrium, ConstrainedEquilibrium)
        row["active_limits"] = [asdict(limit) for limit in equilibrium.active]
        row["optimality"] = equilibrium.optimality()
        row["limit_margins"] = [asdict(m) for m in limit_margins(equilibrium, limits)]
        row["next_change"] = _changes(
            PathScan(path, criterion, limits), results[criterion.name], tangent
        )
        if not row["next_change"]:
            answer.setdefault("notes", []).append(
                f"the limits that {criterion.name} presses here are degenerate: the next change of "
                "them is not told. Move a little."
            )
        own = PathScan(path, criterion)
        row["limit_travel"] = {
            f"{'+' if side > 0 else '-'}y": [
                {
                    "name": t.name,
                    "margin": t.margin.value,
                    "unit": t.margin.unit,
                    "first_order": t.first_order,
                    "exact": t.exact,
                }
                for t in own.travel(limits, side).limits
            ]
            for side in (1, -1)
        }


def _changes(scan: PathScan, result: CopSensitivity, tangent: Any) -> dict[str, Any]:
    """The next change of the active limits to either side; nothing where none can be told."""
    found: dict[str, Any] = {}
    try:
        for side in (1, -1):
            first = result.next_active_set_change(side * tangent)
            exact = scan.next_active_set_change(side)
            found[f"{'+' if side > 0 else '-'}y"] = {
                "first_order": _change(first),
                "exact": _change(exact),
            }
    except CopsenseError:
        return {}
    return found


def _change(change: ActiveSetChange | None) -> dict[str, Any] | None:
    if change is None:
        return None
    return {
        "name": change.name,
        "kind": change.kind,
        "binds": change.binds,
        "travel": change.travel,
    }


def limit_verdict(answer: dict[str, Any]) -> str:
    """The same of the first limit met to either side, found along the path."""
    reach = {
        name: min(
            (math.inf if t["exact"] is None else t["exact"], t["name"])
            for travels in row["limit_travel"].values()
            for t in travels
        )
        for name, row in answer["criteria"].items()
    }
    best = max(reach, key=lambda name: reach[name][0])
    distance, limit = reach[best]
    if distance == 0:
        return "Every criterion meets a limit here already."
    if not math.isfinite(distance):
        return f"{best} meets no limit within reach."
    others = ", ".join(f"{n} {reach[n][0] * 1e3:.1f} mm" for n in reach if n != best)
    return (
        f"{best} is the last to meet a limit: the CoM may move {distance * 1e3:.1f} mm until "
        f"{limit}" + (f" ({others})." if others else ".")
    )


def print_limits(row: dict[str, Any]) -> None:
    """Active limits, and how far the CoM may go to either side.

    To the next change of them the wrenches are those within the limits; to each limit they are the
    criterion's own.
    """
    click.echo(f"  active limits: {'; '.join(_named(row['active_limits'])) or 'none'}")
    for side, change in row["next_change"].items():
        first, exact = change["first_order"], change["exact"]
        if row["active_limits"] and exact is not None:
            predicted = f"{first['travel'] * 1e3:.1f}" if first else "never"
            click.echo(
                f"  CoM to {side}: {exact['travel'] * 1e3:6.1f} mm until {exact['name']} "
                f"{'binds' if exact['binds'] else 'lets go'} (first order: {predicted})"
            )
    if row["active_limits"]:
        click.echo("  unclipped, the criterion's own wrenches:")
    for side, travels in row["limit_travel"].items():
        for travel in travels[:3]:
            if travel["exact"] is None:
                continue
            first = travel["first_order"]
            predicted = f"{first * 1e3:.1f}" if math.isfinite(first) else "never"
            predicted = "met" if travel["exact"] == 0 else f"first order: {predicted}"
            click.echo(
                f"  CoM to {side}: {travel['exact'] * 1e3:6.1f} mm to {travel['name']} "
                f"({predicted})"
            )


def presses(row: dict[str, Any]) -> bool:
    """Whether a limit clips the wrenches of a criterion."""
    return any(limit["multiplier"] for limit in row.get("active_limits", ()))


def _named(active: list[dict[str, Any]]) -> list[str]:
    """Names of active limits; the sides of a pyramid that are merely touched stand together."""
    names = [limit["name"] for limit in active if limit["multiplier"]]
    touched: dict[str, list[str]] = {}
    for limit in active:
        if not limit["multiplier"]:
            touched.setdefault(limit["name"].partition(" towards ")[0], []).append(limit["name"])
    for common, each in touched.items():
        name = each[0] if len(each) == 1 else f"{common} {len(each)} ways"
        names.append(f"{name} (touched)")
    return names


def add_regions(
    answer: dict[str, Any],
    stance: Stance,
    criteria: list[Criterion],
    limits: Limits,
    picture: str,
    *,
    overwrite: bool,
) -> None:
    """The regions of the CoM that the limits leave, drawn with the soles and the lateral path."""
    from copsense.path import lateral_sweep
    from copsense.plots import plot_regions, save_figure
    from copsense.plots.style import Figure
    from copsense.regions import com_region, criterion_region
    from copsense.sweeps import sweep

    regions = {"friction and soles": com_region(stance, replace(limits, torque=None))}
    if limits.torque is not None:
        regions["and torque limits"] = com_region(stance, limits)
    for criterion in criteria:
        regions[criterion.name] = criterion_region(stance, criterion, limits)
    y = float(stance.com[1])
    x = None if stance.robot.base_nv != 6 else float(stance.com[0])
    path = lateral_sweep(stance, y - _REACH, y + _REACH, _POSTURES, com_x=x)
    figure = plot_regions(regions, sweep(path, criteria), com=stance.com[:2]).figure
    assert isinstance(figure, Figure)
    save_figure(figure, picture, overwrite=overwrite)
    answer["regions"] = {
        "plot": picture,
        "of": {
            name: {
                "polygon": region.polygon,
                "area": region.area,
                "gap": region.gap,
                "bounded": region.bounded,
                "margin": region.margin(stance.com[:2]),
            }
            for name, region in regions.items()
        },
    }


def print_regions(regions: dict[str, Any]) -> None:
    """How large they are, and how far the CoM is inside."""
    click.echo("regions of the CoM, contacts and joints held at this posture:")
    width = max(map(len, regions["of"]))
    for name, row in regions["of"].items():
        click.echo(f"  {name:{width}}  {_size(row)}")
    click.echo(f"drawn: {regions['plot']}")


def _size(row: dict[str, Any]) -> str:
    if not len(row["polygon"]):
        return "empty"
    if not row["bounded"]:
        return "without end"
    size = f"{row['area'] * 1e4:8.1f} cm2"
    if row["area"] == 0:
        size = f"{math.dist(row['polygon'][0], row['polygon'][-1]) * 1e3:8.1f} mm wide"
    where = "inside" if row["margin"] >= 0 else "outside"
    return f"{size}, the CoM {abs(row['margin']) * 1e3:.1f} mm {where}"
