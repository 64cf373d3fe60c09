"""Every kind of criterion, for the laws that hold for all of them."""

import numpy as np

import copsense


def random_spd(size, seed):
    """A symmetric positive-definite matrix with a condition number of a hundred or so."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((size, size))
    return A @ A.T / size + 0.1 * np.eye(size)


def criteria(stance):
    """Name -> criterion, each determining the wrenches of a robot on two feet."""
    rng = np.random.default_rng(5)
    n, m = len(stance.robot.torque_names), len(stance.component_index)
    weight, feet = stance.robot.weight, stance.contact_names
    wrench, torque = copsense.minimum_wrench(1.0), copsense.minimum_torque()
    supporting = {j: 1.0 + 0.1 * i for i, j in enumerate(stance.robot.torque_names)}
    # What a controller might ask for: more load on one foot, inwards forces, small moments.
    wanted = rng.uniform(-0.1, 0.1, (2, 6)) * weight + [[0, 0, 0.6 * weight, 0, 0, 0]] * 2
    inertia = copsense.weighted_torque("inverse inertia")
    effort = stance.robot.effort_limits
    # Where the model gives placeholders, the joints that have them cost nothing.
    over = {j: float(t) ** -2 for j, t in zip(supporting, effort, strict=True) if np.isfinite(t)}
    cases = {
        "minimum wrench": wrench,
        "minimum wrench, short length": copsense.minimum_wrench(0.07),
        "minimum torque": torque,
        "torque weights by joint": copsense.weighted_torque(supporting),
        "torque weights, diagonal": copsense.weighted_torque(rng.uniform(0.2, 3.0, n)),
        "torque weights, full": copsense.weighted_torque(random_spd(n, 1)),
        "torque over limits": copsense.weighted_torque(
            "1/limit^2" if np.all(np.isfinite(effort)) else over
        ),
        "inverse inertia": inertia,
        "inverse inertia and torque": copsense.mixed((inertia, 0.3), (torque, 2.0)),
        "tangential, then wrench": copsense.minimum_tangential(wrench),
        "tangential, then torque": copsense.minimum_tangential(torque),
        "tangential, then full torque": copsense.minimum_tangential(
            copsense.weighted_torque(random_spd(n, 2))
        ),
        "wrench weights, full": copsense.Criterion(
            "full", (copsense.WrenchTerm(random_spd(m, 3)),)
        ),
        "wrench weights by contact": copsense.Criterion(
            "by contact",
            (copsense.WrenchTerm({feet[0]: [1, 1, 1, 9, 9, 9], feet[1]: [3, 2, 1, 20, 10, 30]}),),
        ),
        "reference wrench": copsense.criterion.reference_wrench(wanted, 0.5),
        "mixed": copsense.mixed((wrench, 1e-2), (torque, 1.0)),
        "mixed with a reference": copsense.mixed(
            (copsense.criterion.reference_wrench(wanted, 0.3), 0.5), (inertia, 0.1), (wrench, 0.02)
        ),
    }
    return {name: criterion.named(name) for name, criterion in cases.items()}


CRITERIA = (
    "minimum wrench",
    "minimum wrench, short length",
    "minimum torque",
    "torque weights by joint",
    "torque weights, diagonal",
    "torque weights, full",
    "torque over limits",
    "inverse inertia",
    "inverse inertia and torque",
    "tangential, then wrench",
    "tangential, then torque",
    "tangential, then full torque",
    "wrench weights, full",
    "wrench weights by contact",
    "reference wrench",
    "mixed",
    "mixed with a reference",
)
