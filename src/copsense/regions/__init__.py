"""Regions: where the centre of mass may be over the ground, the contacts in place.

Three nested convex sets of horizontal CoM positions c:

* a static equilibrium exists that friction and the soles allow: `com_region` with ``torque=None``;
* it exists within the joint torque limits too: `com_region` with torque limits;
* the criterion's own wrenches stay within all of them, with no QP to clip them:
  `criterion_region`.

`com_regions` gives them all. They hold the contacts' Jacobian J and the gravity torques G_j of the
joints at the stance's posture, as [Bretl2008] and [Orsolino2020] do, and move the weight's line of
action alone:

    J_b' f = G_b(c) = G_b + S (c - c0),    S (c - c0) the moment of the weight moved by c - c0,
    A f <= b,    -t <= tau <= t,    tau = G_j - J_j' f.

That is exact for a load that shifts on the base's link. It is exact for every posture with these
contacts where torques take no part: friction and soles alone, and the minimum wrench, know only
the contacts and the CoM. Torques do depend on the posture, so a robot that leans by itself meets
other limits than one whose load shifts: ``criterion_region(..., moving=True)`` is the first order
of that, and `copsense.scan.limit_travel` follows the posture exactly.

[Bretl2008] T. Bretl, S. Lall, "Testing Static Equilibrium for Legged Robots", IEEE Transactions on
Robotics 24(4), 2008. [Orsolino2020] R. Orsolino et al., "Feasible Region: An Actuation-Aware
Extension of the Support Region", IEEE Transactions on Robotics 36(4), 2020.
"""

from __future__ import annotations

from copsense.regions.feasible_region import FINEST, com_region
from copsense.regions.nested_regions import ComRegions, com_regions
from copsense.regions.region import BOX, ComRegion
from copsense.regions.unclipped_region import criterion_region
from copsense.regions.weight_line import balance_at

__all__ = [
    "BOX",
    "FINEST",
    "ComRegion",
    "ComRegions",
    "balance_at",
    "com_region",
    "com_regions",
    "criterion_region",
]
