"""The report's section on a real robot: its figures, its numbers, what it does not show."""

from __future__ import annotations

from dataclasses import replace

from copsense.log_report import draw_log_figures
from copsense.log_report.log_words import BADGES, answer, reach
from copsense.paper.reproduce import RECORDED, RealRobot
from copsense.paper.reproduce.real_robot import PUBLIC_LOG, PUBLIC_URDF
from copsense.reports import ReportFigure

_SECTION = "real"
_SHOWN = ("real_intervals", "real_slope", "real_load", "real_cop")
_RECORDED_REACH = (
    "One sway of 27.7 mm at 0.20 Hz: nothing is said of larger or faster motions.",
    "Normal forces alone: no centre of pressure was recorded, so that Figs. 7 to 9 are compared "
    "with nothing.",
    "The robot's controller is not stated. One on position servos of equal stiffness shares its "
    "load as minimum torque does.",
)


def real_figures(real: RealRobot | None) -> tuple[ReportFigure, ...]:
    """The figures of the log that was given; none without one."""
    if real is None:
        return ()
    found = draw_log_figures(real.comparison, "real")
    return tuple(replace(f, section=_SECTION) for f in found if f.name in _SHOWN)


def real_rows(real: RealRobot | None) -> list[dict[str, str]]:
    """A row for each number, of the log that was given or of the public one as recorded."""
    rows = []
    for found in RECORDED if real is None else real.findings:
        kind, mark = BADGES.get(found.place, ("", ""))
        factor, unit = (1e3, " mm") if found.unit == "m" else (1.0, "")
        digits = 1 if unit else 3
        value, low, high = (
            f"{x * factor:.{digits}f}" for x in (found.value, found.low, found.high)
        )
        rows.append(
            {
                "name": found.name,
                "what": found.what,
                "value": value + unit,
                "interval": f"[{low}, {high}]{unit}",
                "place": found.place,
                "kind": kind,
                "mark": mark,
                "against": found.against,
            }
        )
    return rows


def real_words(real: RealRobot | None) -> tuple[str, ...]:
    """What was recorded, and whether this run read it."""
    if real is not None:
        return answer(real.comparison)[:2]
    measured = RECORDED[0]
    return (
        "No log was given to this run. The numbers below are those that copsense finds in a public "
        f"one, {PUBLIC_LOG}: a real iCubGenova04 that swayed its centre of mass by 27.7 mm at "
        "0.2 Hz for 20 s on feet 212 mm apart; joints and the normal force of each foot.",
        f"Its load went from foot to foot at {measured.value:.3f} [{measured.low:.3f}, "
        f"{measured.high:.3f}] of the centre of mass's moment: 1 would be all of it, 0 none.",
    )


def real_reach(real: RealRobot | None) -> tuple[str, ...]:
    """What the log does not show."""
    return _RECORDED_REACH if real is None else reach(real.comparison)


def real_commands() -> tuple[str, ...]:
    """The commands that give the section's numbers, once the log is there."""
    log = f"{PUBLIC_LOG} --robot {PUBLIC_URDF}"
    identify = f"copsense identify {log} --family joints --family length"
    return (
        f"copsense reproduce --log {PUBLIC_LOG} --log-robot {PUBLIC_URDF}",
        f"copsense log {log} --report swaying",
        identify,
        f"{identify} --at-rest",
    )
