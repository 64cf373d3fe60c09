"""Random postures, soles, criteria and limits, each criterion and limit also as plain numbers."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

import copsense
from copsense.limits import Limits
from copsense.posture import pull_back

SIDES = (3, 4, 5, 8, 12, 32)


@dataclass(frozen=True)
class Case:
    """A problem for copsense, and the matrices of its cost for whoever solves it again."""

    stance: copsense.Stance
    criterion: copsense.Criterion
    limits: Limits
    torque_weight: np.ndarray  # (n, n)
    wrench_weight: np.ndarray  # (m, m)
    reference: np.ndarray  # (m,)


def random_stance(stance, rng, *, turn=0.1, shift=0.04):
    """A random posture with the feet in place, on random soles and friction."""
    model = stance.robot.model
    kicked = pin.integrate(model, stance.q, turn * rng.standard_normal(model.nv))
    found = pull_back(stance.at(kicked, check=False), stance.placements)
    if rng.random() < 0.5:
        x, y, _ = found.com
        dx, dy = shift * rng.standard_normal(2)
        com = (None if stance.robot.base_nv == 3 else x + dx, y + dy, None)
        found = copsense.solve_posture(found, com=com).stance
    return stance.at(found.q).with_contacts([random_contact(c, rng) for c in stance.contacts])


def random_contact(contact, rng):
    """The contact with random friction and, if it has a sole, a random convex one."""
    contact = replace(contact, friction=rng.uniform(0.2, 1.0))
    if contact.kind == "planar":
        return replace(contact, polygon=np.array([[0, -rng.uniform(0.01, 0.1)], [0, 0.05]]))
    if contact.kind == "point":
        return contact
    if rng.random() < 0.5:
        x, y = rng.uniform(0.02, 0.12, 2), rng.uniform(0.015, 0.07, 2)
        polygon = copsense.rectangle((-x[0], x[1]), (-y[0], y[1]))
    else:
        angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(5, 12)))
        polygon = np.column_stack([0.1 * np.cos(angles), 0.05 * np.sin(angles)])
        polygon = np.vstack([polygon, [[0.02, 0.0], [-0.02, 0.02], [-0.02, -0.02]]])
    return replace(contact, polygon=polygon, torsional_friction=rng.uniform(0.005, 0.1))


def random_case(stance, rng):
    """A random criterion within random limits at a stance."""
    n, m = len(stance.robot.torque_names), len(stance.component_index)
    W, F, reference = np.zeros((n, n)), np.zeros((m, m)), np.zeros(m)
    kinds = ["wrench", "torque", "diagonal", "full", "limit", "mix", "full wrench", "reference"]
    if stance.robot.base_nv == 6:
        kinds.append("inertia")
    kind = rng.choice(kinds)
    length = float(np.exp(rng.uniform(np.log(0.03), np.log(3.0))))
    moment = 1 / length**2
    norm = np.diag([1.0 if i < 3 else moment for i in stance.component_index])
    if kind == "wrench":
        criterion, F = copsense.minimum_wrench(length), norm
    elif kind == "torque":
        criterion, W = copsense.minimum_torque(), np.eye(n)
    elif kind == "diagonal":
        weights = np.exp(rng.uniform(-3, 3, n))
        criterion, W = copsense.weighted_torque(weights), np.diag(weights)
    elif kind == "full":
        W = random_spd(n, rng)
        criterion = copsense.weighted_torque(W)
    elif kind == "limit":
        effort = np.asarray(stance.robot.model.upperEffortLimit)[stance.robot.base_nv :]
        if np.all((effort > 0) & (effort < 1e3)):
            criterion, W = copsense.weighted_torque("1/limit^2"), np.diag(effort**-2.0)
        else:
            criterion, W = copsense.minimum_torque(), np.eye(n)
    elif kind == "inertia":
        criterion = copsense.weighted_torque("inverse inertia")
        M = pin.crba(stance.robot.model, stance.robot.model.createData(), stance.q)
        M = np.triu(M) + np.triu(M, 1).T
        W = np.linalg.inv(M[6:, 6:])
    elif kind == "mix":
        share = float(np.exp(rng.uniform(np.log(1e-4), np.log(10.0))))
        parts = (copsense.minimum_torque(), 1.0), (copsense.minimum_wrench(length), share)
        criterion, W, F = copsense.mixed(*parts), np.eye(n), share * norm
    elif kind == "full wrench":
        F = random_spd(m, rng)
        criterion = copsense.Criterion("full wrench", (copsense.WrenchTerm(F),))
    else:
        wanted = 0.3 * stance.robot.weight * rng.standard_normal((len(stance.contacts), 6))
        criterion, F = copsense.criterion.reference_wrench(wanted, length), norm
        reference = stance.stack(wanted)
    limits = random_limits(stance, criterion, rng)
    return Case(stance, criterion.named(str(kind)), limits, W, F, reference)


def random_limits(stance, criterion, rng):
    """Limits of every kind, each on or off, tight enough to press now and then."""
    torque = None
    if rng.random() < 0.35:
        free = np.abs(copsense.solve_equilibrium(stance, criterion).torques)
        torque = float(free.max() * rng.uniform(0.5, 1.1))
        if rng.random() < 0.5:
            names = stance.robot.torque_names
            chosen = rng.choice(len(names), size=min(4, len(names)), replace=False)
            torque = {names[i]: float(rng.uniform(0.5, 1.5) * free[i] + 0.5) for i in chosen}
    torsion = rng.choice([None, "contact", "number", "cone"], p=[0.2, 0.35, 0.2, 0.25])
    cone = torsion == "cone"
    friction = rng.choice([None, "contact", "number"], p=[0.2, 0.55, 0.25])
    if friction == "number" or (cone and friction is None):
        friction = float(rng.uniform(0.2, 1.0))
    sides = SIDES[rng.integers(4 if cone else len(SIDES))]
    normal = rng.choice([None, 0.0, 0.05 * stance.robot.weight], p=[0.1, 0.5, 0.4])
    chosen = Limits(
        normal_force=normal,
        friction=friction,
        friction_sides=int(sides),
        cop_margin=[None, 0.0, 0.004][rng.choice(3, p=[0.15, 0.5, 0.35])],
        torsion=float(rng.uniform(0.0, 0.05)) if torsion == "number" else torsion,
        torque=torque,
    )
    return chosen if chosen.any else Limits()


def random_spd(size, rng):
    """A symmetric positive-definite matrix with a condition number of a hundred or so."""
    A = rng.standard_normal((size, size))
    return A @ A.T / size + 0.05 * np.eye(size)
