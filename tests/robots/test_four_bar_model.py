"""Three ways to one four-bar: closed forms, the rigid-body model, and planar statics of its own."""

import numpy as np
import pytest
from support.differences import relative

import copsense
from copsense.paper import FourBar, solve_four_bar

CASES = 25
EXACT = 1e-10
FEET = tuple(copsense.Contact(f"{side}_sole", kind="planar") for side in "lr")
JOINTS = ("l_hip", "l_ankle", "r_hip", "r_ankle")


def random_case(seed):
    """A linkage, an angle short of where a foot unloads, and weights of common size."""
    rng = np.random.default_rng(seed)
    four_bar = FourBar(*(float(x) for x in rng.uniform((0.2, 0.05, 1, 1), (1.2, 0.8, 20, 40))))
    reach = four_bar.kappa * four_bar.leg_length
    travel = rng.uniform(-0.45, 0.45) * min(four_bar.rod_length, reach)
    hip, ankle = rng.uniform(0.5, 2.0, 2)
    return four_bar, float(np.arccos(travel / reach)), float(hip), float(ankle)


def criteria(kind, four_bar, hip, ankle):
    """Per criterion: the library's, the closed form's parameters, the weights of (f, tau)."""
    if kind == "minimum-torque":
        return [(copsense.minimum_torque(), {}, [0] * 6 + [1] * 4)]
    if kind == "weighted-torque":
        weights = dict(zip(JOINTS, (hip, ankle, hip, ankle), strict=True))
        parameters = {"hip_weight": hip, "ankle_weight": ankle}
        return [(copsense.weighted_torque(weights), parameters, [0] * 6 + list(weights.values()))]
    found = []
    for L in (1.0, 0.1, four_bar.rod_length / 2):
        criterion = copsense.minimum_wrench(L)
        if kind == "minimum-tangential":
            criterion = copsense.minimum_tangential(tie_break=criterion)
        found.append((criterion, {"characteristic_length": L}, [1, 1, L**-2] * 2 + [0] * 4))
    return found


def planar_minimum(four_bar, xi, weights, *, no_tangential=False):
    """(fy, fz, mx) of the left and right foot, then l_hip, l_ankle, r_hip, r_ankle.

    Newton and Euler on the whole, on the massless feet and on the legs about their hips; a complex
    xi gives derivatives. World y-z plane, the left foot at +y, moments and torques about x.
    """
    d, g = four_bar.rod_length, four_bar.gravity
    c, s = four_bar.leg_length * np.cos(xi), four_bar.leg_length * np.sin(xi)
    A, b = np.zeros((8 if no_tangential else 7, 10), complex), np.zeros(8, complex)
    A[0, [0, 3]] = 1
    A[1, [1, 4]], b[1] = 1, four_bar.weight
    # The hips are at (-c, s) from the feet, the CoM kappa times that from between them.
    A[2, [2, 5]], A[2, 1], A[2, 4] = 1, d / 2, -d / 2
    b[2] = -four_bar.weight * four_bar.kappa * c
    for k in range(2):
        fy, fz, mx, hip, ankle = 3 * k, 3 * k + 1, 3 * k + 2, 6 + 2 * k, 7 + 2 * k
        A[3 + k, [mx, ankle]] = 1
        # tau_hip + m_x + c f_z + s f_y = m_l g c / 2
        A[5 + k, [hip, mx]], A[5 + k, fz], A[5 + k, fy] = 1, c, s
        b[5 + k] = four_bar.leg_mass * g * c / 2
    if no_tangential:
        A[7, 0] = 1
    m = len(A)
    kkt = np.block([[np.diag(weights), A.T], [A, np.zeros((m, m))]])
    return np.linalg.solve(kkt, np.concatenate([np.zeros(10), b[:m]]))[:10]


def stance_at(four_bar, xi):
    robot = copsense.robots.four_bar_robot(
        four_bar.leg_length, four_bar.rod_length, four_bar.leg_mass, four_bar.body_mass
    )
    return copsense.Stance(robot, robot.configuration(copsense.robots.four_bar_angles(xi)), FEET)


def motion(four_bar, xi):
    """dq/dxi: the rod translates, hips and ankles turn against each other."""
    l = four_bar.leg_length
    return np.array([l * np.sin(xi), l * np.cos(xi), 0, -1, 1, -1, 1])


KINDS = ("minimum-wrench", "minimum-torque", "weighted-torque", "minimum-tangential")
every_kind = pytest.mark.parametrize("kind", KINDS)


@every_kind
def test_model_has_the_closed_forms_wrenches_torques_cops_and_sensitivities(kind):
    for seed in range(CASES):
        four_bar, xi, hip, ankle = random_case(seed)
        stance, tangent = stance_at(four_bar, xi), motion(four_bar, xi)
        for criterion, parameters, _ in criteria(kind, four_bar, hip, ankle):
            exact = solve_four_bar(four_bar, xi, kind, **parameters)
            found = copsense.cop_sensitivity(stance, criterion)
            # The paper's x is -y here and its moments are about -x; its left foot is at +y.
            wrenches = found.equilibrium.wrenches
            assert relative(wrenches[:, 1:4], exact.wrenches * [-1, 1, -1]) < EXACT
            assert not np.any(wrenches[:, [0, 4, 5]])
            assert relative(found.equilibrium.torques, -exact.torques) < EXACT
            assert relative(found.cop[:, 1], -exact.cop) < EXACT
            assert relative(found.along(tangent)[:, 1], -exact.sensitivity) < EXACT
            # CoM y runs against the paper's x too, so their ratio keeps its sign.
            assert relative(found.com_gain[:, 1, 1], exact.cop_per_com) < EXACT


@every_kind
def test_model_has_the_planar_statics_wrenches_torques_cops_and_sensitivities(kind):
    def cops(z):
        return z[[2, 5]] / z[[1, 4]]

    for seed in range(CASES):
        four_bar, xi, hip, ankle = random_case(seed)
        stance, tangent = stance_at(four_bar, xi), motion(four_bar, xi)
        for criterion, _, weights in criteria(kind, four_bar, hip, ankle):
            z = planar_minimum(
                four_bar, xi + 1e-30j, weights, no_tangential=kind == "minimum-tangential"
            )
            found = copsense.cop_sensitivity(stance, criterion)
            wrenches, torques = found.equilibrium.wrenches, found.equilibrium.torques
            assert relative(wrenches[:, 1:4].ravel(), z[:6].real) < EXACT
            assert relative(torques, z[6:].real) < EXACT
            assert relative(found.cop[:, 1], cops(z).real) < EXACT
            assert relative(found.along(tangent)[:, 1], cops(z).imag / 1e-30) < EXACT
            rates = found.wrench_derivative[:, 1:4] @ (found.basis.T @ tangent)
            assert relative(rates.ravel(), z[:6].imag / 1e-30) < EXACT


def test_inverse_inertia_transfers_all_load_and_stills_the_cops():
    # Massless feet make the inertia singular; its inverse as a weight is a limit that exists.
    for seed in range(CASES):
        four_bar, xi, _, _ = random_case(seed)
        stance = stance_at(four_bar, xi)
        found = copsense.cop_sensitivity(stance, copsense.weighted_torque("inverse inertia"))
        travel = four_bar.com(xi)[0] / four_bar.rod_length
        shares = np.array([1 - travel, travel])
        assert relative(found.equilibrium.wrenches[:, 2], shares * four_bar.weight) < EXACT
        assert np.abs(found.cop).max() < EXACT * four_bar.rod_length
        assert np.abs(found.matrix).max() < EXACT


def test_only_motion_left_is_the_papers_xi():
    for seed in range(CASES):
        four_bar, xi, _, _ = random_case(seed)
        stance, tangent = stance_at(four_bar, xi), motion(four_bar, xi)
        assert np.abs(stance.jacobian @ tangent).max() < 1e-14
        assert stance.admissible_motions.shape == (7, 1)
