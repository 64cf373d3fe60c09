"""The controller of a robot whose motors are not one on each joint, beside dynamics written apart.

Dynamics apart: M dv + h = S t + J' f + L' lam with J dv + dJ v = 0 and L dv + dL v = 0; bias,
loads, rows and their rates by other means than the controller's.
"""

import pickle
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from statics.test_driven_statics import CASES as BIPEDS
from statics.test_driven_statics import rods
from support.driven_robots import five_bars, rod_biped_model, rod_drives, standing
from support.statics_apart import (
    balance,
    frame_at,
    jacobian_at,
    loop_gaps,
    loop_rows,
    motor_map,
)

import copsense
from copsense import Drives, Limits, Load, Robot, Stance
from copsense.controllers import (
    STIFF,
    BalancingController,
    Hold,
    LoadProblem,
    Observation,
    Sine,
    lateral_reference,
)
from copsense.controllers.sharing import ShareByCriterion
from copsense.drives import Spring
from copsense.errors import UnbalancedError, UnstablePostureError
from copsense.posture import retract

AT_REST = 1e-9  # of the weight, in N and Nm
APART = 1e-7

C1, C2 = copsense.minimum_wrench(0.5), copsense.minimum_torque()
WEIGHTED = copsense.weighted_torque("inverse inertia")


def icub_with_sprung_ankles():
    soft = ("l_ankle_roll", "r_ankle_roll", "l_elbow")
    return copsense.load_stance(
        "icub",
        drives=Drives(springs=dict.fromkeys(soft[:2], Spring(40.0))).without_motors(
            soft, copsense.load_robot("icub").dof_names
        ),
    ).with_loads([Load("r_hand", (4.0, -3.0, -12.0))])


CASES = BIPEDS | {"five bars": five_bars, "sprung ankles": icub_with_sprung_ankles}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return CASES[request.param]()


def asked(stance, q, v, target, controller):
    return controller(Observation(0.0, q, v, target, np.zeros((len(stance.contacts), 6))))


@pytest.mark.parametrize("limits", [None, Limits(friction=0.9, torque=200.0)], ids=["", "within"])
@pytest.mark.parametrize("criterion", [C1, C2, WEIGHTED], ids=lambda c: c.name)
def test_the_controller_at_rest_is_the_static_equilibrium(case, criterion, limits):
    if limits and any(contact.kind == "surface" for contact in case.contacts):
        limits = Limits(friction=0.9, cop_margin=0.001, torque=200.0)
    static = copsense.solve_equilibrium(case, criterion, limits)
    controller = BalancingController(case, criterion, limits=limits)
    target = lateral_reference(case, Hold()).at(0.0)
    command = asked(case, case.q, np.zeros(case.robot.model.nv), target, controller)
    weight = case.robot.weight
    assert len(command.torques) == len(case.robot.torque_names)
    assert np.abs(command.wrenches - static.wrenches).max() < AT_REST * weight
    assert np.abs(command.torques - static.torques).max() < AT_REST * weight


def contact_rows(stance, q):
    """Stacked contact rows in contact axes, which turn with a sole and stay for a point."""
    rows = []
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        J = jacobian_at(stance.robot, q, contact.frame)
        J = _about(stance.robot, q, contact, J)
        if contact.kind == "point":
            rows.append(place.rotation.T @ J[:3])
        else:
            at = contact.on(stance.robot)
            R = _placed(stance.robot, q, at).rotation.T
            rows.append(np.vstack([R @ J[:3], R @ J[3:]]))
    return np.vstack(rows)


def _placed(robot, q, at):
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    return data.oMi[at.joint] * at.placement


def _about(robot, q, contact, J):
    """The Jacobian about the contact's own point, which may lie off its frame."""
    arm = (
        _placed(robot, q, contact.on(robot)).translation
        - frame_at(robot, q, contact.frame).translation
    )
    J = J.copy()
    J[:3] -= pin.skew(arm) @ J[3:]
    return J


class Moving:
    """A robot in motion, contacts and loops at rest, and what it is to do; by means apart.

    Attributes: stance, q, v, target; rows C, drift dC/dt v; mass M, and N with the motion's part.
    """

    def __init__(self, stance):
        rng = np.random.default_rng(5)
        robot, model, Z = stance.robot, stance.robot.model, stance.admissible_motions
        self.stance = stance
        self.q = q = retract(stance, Z @ rng.normal(size=Z.shape[1]) * 5e-3).q
        L = loop_rows(robot, q).reshape(-1, model.nv)
        self.C = np.vstack([contact_rows(stance, q), L])
        _, s, vt = np.linalg.svd(self.C)
        free = vt[int(np.sum(s > 1e-6)) :]
        self.v = v = free.T @ rng.normal(size=len(free)) * 0.1
        self.target = lateral_reference(stance, Sine(0.01, 0.3)).at(0.2)
        self.M = pin.crba(model, model.createData(), q)
        still = pin.computeGeneralizedGravity(model, model.createData(), q)
        moving = pin.nonLinearEffects(model, model.createData(), q, v)
        self.N = balance(stance.at(q, check=False)) + moving - still
        # At a constant velocity the gaps' second derivative is dL/dt v.
        h = 5e-3
        at = {k: pin.integrate(model, q, k * h * v) for k in range(-2, 3)}
        J = {k: contact_rows(stance, at[k]) @ v for k in (-2, -1, 1, 2)}
        g = {k: loop_gaps(robot, there) for k, there in at.items()}
        turned = (8 * (J[1] - J[-1]) - (J[2] - J[-2])) / (12 * h)
        bent = (16 * (g[1] + g[-1]) - (g[2] + g[-2]) - 30 * g[0]) / (12 * h**2)
        self.drift = np.concatenate([turned, bent])

    def command(self, limits=None):
        controller = BalancingController(self.stance, C2, limits=limits)
        return asked(self.stance, self.q, self.v, self.target, controller)

    def under(self, torques):
        """Accelerations and contact forces under motor torques."""
        S, motors = motor_map(self.stance.robot)
        known = dict(zip(self.stance.robot.torque_names, torques, strict=True))
        pushed = S @ [known[motor] for motor in motors] - self.N
        W = self.C @ np.linalg.solve(self.M, self.C.T)
        # Constraints that say the same twice: forces of least size.
        wanted = self.C @ np.linalg.solve(self.M, pushed) + self.drift
        x = -np.linalg.lstsq(W, wanted, rcond=1e-9)[0]
        forces = x[: len(self.stance.row_names)]
        return np.linalg.solve(self.M, pushed + self.C.T @ x), self.stance.unstack(forces)


@cache
def moving(name):
    return Moving(CASES[name]())


@pytest.mark.parametrize("name", CASES)
def test_under_its_torques_forces_are_the_commanded_and_the_momentum_is_the_wanted(name):
    here = moving(name)
    stance, target, command = here.stance, here.target, here.command()
    dv, wrenches = here.under(command.torques)
    assert np.abs(wrenches - command.wrenches).max() < APART * stance.robot.weight
    # Eq. (19): the CoM's acceleration is the reference's and the gains' own.
    model, gains = stance.robot.model, STIFF
    data = model.createData()
    pin.centerOfMass(model, data, here.q, here.v, dv)
    wanted = (
        target.com_acceleration
        - np.array(gains.com_stiffness) * (data.com[0] - target.com)
        - np.array(gains.com_damping) * (data.vcom[0] - target.com_velocity)
    )
    assert np.abs(wanted).max() > 0.05
    # Where yaws are coupled one change of the momentum would take violent motions.
    off = np.abs(data.acom[0] - wanted).max()
    assert off < (0.3 if name in ("couplings", "all at once") else 1e-6)


@pytest.mark.parametrize("name", ["pinned rods", "five bars", "all at once"])
def test_where_the_rate_yields_to_limits_the_forces_are_still_those_of_the_torques(name):
    here = moving(name)
    free, weight = here.command(), here.stance.robot.weight
    most = 0.9 * float(np.abs(free.torques).max())
    command = here.command(Limits(friction=0.2, cop_margin=None, torque=most))
    assert np.abs(command.wrenches - free.wrenches).max() > 1e-3 * weight
    assert np.abs(command.torques).max() < most * (1 + 1e-6)
    _, wrenches = here.under(command.torques)
    assert np.abs(wrenches - command.wrenches).max() < APART * weight


def test_a_share_of_the_users_own_gets_the_whole_problem():
    stance, seen = rods("pin"), []

    def share(problem):
        seen.append(problem)
        return ShareByCriterion(stance, C1)(problem)

    BalancingController(stance, C2, share=share)
    own = LoadProblem.of(stance)
    assert np.abs(seen[-1].base_map - own.base_map).max() < 1e-12
    assert np.abs(seen[-1].base_wrench - own.base_wrench).max() < 1e-9
    assert np.abs(seen[-1].torque_offset - own.torque_offset).max() < 1e-9


def hanging(angle, **springs):
    """A biped whose forearm has no motor, at an angle to the vertical with the upper arm down."""
    motors = tuple(j for j in rod_drives().motors if j != "forearm")
    robot = Robot.from_model(
        rod_biped_model(), drives=Drives(motors=motors, loops=rod_drives().loops, springs=springs)
    )
    full = standing(
        Robot.from_model(rod_biped_model(), drives=rod_drives()),
        joints={"arm": 0.0, "forearm": angle},
    )
    q = full.q.copy()
    # The links' own axes turn with the trunk: find the angle at which gravity asks for nothing.
    i = robot.model.joints[robot.joint_id("forearm")].idx_q
    for _ in range(50):
        stance = Stance(robot, q, full.contacts)
        row = robot.velocity_index("forearm")
        slope = stance.balance_derivative(np.zeros(len(stance.constraints)))[row, row]
        q[i] -= stance.balance[row] / slope
    return Stance(robot, q, full.contacts)


def test_what_would_fall_without_a_motor_is_rejected_by_name():
    BalancingController(hanging(0.0), C2)
    upright = hanging(np.pi)
    # At rest it is a stance as any other, and the statics solve it.
    copsense.solve_equilibrium(upright, C2)
    with pytest.raises(UnstablePostureError, match="forearm") as caught:
        BalancingController(upright, C2)
    error = caught.value
    assert error.joints == ("forearm",)
    # A pendulum of 0.7 kg, 0.15 m over its axis.
    assert error.stiffness == pytest.approx(-0.7 * 9.81 * 0.15, rel=1e-6)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    BalancingController(hanging(np.pi, forearm=Spring(1.1, np.pi)), C2)


def test_what_nothing_holds_is_rejected_with_what_it_lacks():
    stance = hanging(0.0)
    q = stance.q.copy()
    q[stance.robot.model.joints[stance.robot.joint_id("forearm")].idx_q] += 0.4
    with pytest.raises(UnbalancedError, match="forearm lacks"):
        BalancingController(Stance(stance.robot, q, stance.contacts), C2)
