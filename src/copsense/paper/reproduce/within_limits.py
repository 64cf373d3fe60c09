"""What limits on the contacts and the motors change, Remark 4."""

from __future__ import annotations

from dataclasses import replace

from copsense.limits import Limits
from copsense.paper.reproduce.clock import Clock
from copsense.paper.reproduce.reproduction import WithinLimits
from copsense.paper.reproduce.sideways import paper_criteria
from copsense.path import LateralPath, PosturePath
from copsense.regions import com_region, criterion_region
from copsense.scan import PathScan
from copsense.stance import Stance
from copsense.sweeps import sweep


def solve_within_limits(
    stance: Stance, path: PosturePath, limits: Limits, clock: Clock
) -> WithinLimits:
    """The lateral sweep within limits, where they first bind, and the regions that they leave."""
    criteria = paper_criteria()
    with clock.stage("limits: sensitivities", len(path)) as advance:
        dataset = sweep(path, criteria, limits, progress=advance)
    with clock.stage("limits: bindings and regions", len(criteria) * 2 + 2) as advance:
        bindings, lateral = [], LateralPath(stance)
        for criterion in criteria:
            scan = PathScan(lateral, criterion, limits)
            for side in (-1, 1):
                found = scan.next_active_set_change(side)
                if found:
                    bindings.append(found)
                advance(1)
        regions = {"friction and soles": com_region(stance, replace(limits, torque=None))}
        if limits.torque is not None:
            regions["and torque limits"] = com_region(stance, limits)
        advance(2)
        for criterion in criteria:
            regions[criterion.name] = criterion_region(stance, criterion, limits)
    return WithinLimits(limits, dataset, tuple(bindings), regions)
