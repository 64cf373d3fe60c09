"""Motors, springs, couplings and loops that descriptions have, beside MuJoCo's own engine."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from support.driven_files import (
    at_stance,
    biped,
    contact_push,
    coupled_and_tendons,
    sprung_rods,
)
from support.statics_apart import frame_at

import copsense
import copsense.closing
from copsense import minimum_torque, solve_equilibrium
from copsense.drives import Coupling, Spring

FEET = ["l_foot", "r_foot"]
BENT = {
    f"{s}_{j}": a
    for s in "lr"
    for j, a in {"hip": -0.35, "knee": 0.7, "ankle_pitch": -0.35}.items()
}
APART = 1e-9  # of the weight

ROBOTS = {"rods and springs": sprung_rods(), "coupling and tendons": coupled_and_tendons()}


@pytest.fixture(scope="module", params=ROBOTS)
def case(request):
    text = ROBOTS[request.param]
    stance = copsense.load_stance(
        text, contacts=FEET, contact_at="sole", posture={**BENT, "l_yaw": 0.1, "shoulder": 0.3}
    )
    return text, solve_equilibrium(stance, minimum_torque())


def shared(text, found):
    """MuJoCo's model and data, what motors and contacts leave of its balance (nv,)."""
    model, data = at_stance(text, found.stance)
    torques = dict(zip(found.stance.robot.torque_names, found.torques, strict=True))
    force = np.zeros(model.nu)
    for a in range(model.nu):
        name = model.actuator(a).name or model.joint(model.actuator_trnid[a][0]).name
        force[a] = torques.pop(name) / model.actuator_gear[a][0]
    assert not torques
    moment = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(
        moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
    )
    left = data.qfrc_bias - data.qfrc_spring - contact_push(model, data, found) - moment.T @ force
    return model, data, left, force


def rows(model, data):
    """MuJoCo's Jacobian of its equalities (e, nv), and how far they are violated (e,)."""
    J = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(
            J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
        )
    else:
        J[:] = data.efc_J.reshape(-1, model.nv)[: data.nefc]
    kept = np.array(data.efc_type[: data.nefc]) == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
    return J[kept], np.array(data.efc_pos[: data.nefc])[kept]


def test_the_stance_meets_mujocos_equalities(case):
    text, found = case
    model, data = at_stance(text, found.stance)
    J, violated = rows(model, data)
    assert len(J) > 0
    assert np.abs(violated).max() < 1e-9


def test_mujocos_equalities_carry_what_motors_and_contacts_leave(case):
    text, found = case
    model, data, left, _ = shared(text, found)
    J, _ = rows(model, data)
    lam = np.linalg.lstsq(J.T, left, rcond=1e-8)[0]
    assert np.abs(J.T @ lam - left).max() < APART * found.stance.robot.weight
    assert np.abs(left).max() > 1e3 * APART * found.stance.robot.weight  # something to carry


def test_loop_forces_are_those_that_mujocos_rows_carry(case):
    text, found = case
    model, data, left, _ = shared(text, found)
    ours = np.array(list(found.loop_forces.values()))
    if found.stance.robot.drives.loops:  # told in the second body's axes, theirs in the world's
        turns = [data.body(f"{s}_ankle").xmat.reshape(3, 3) for s in "lr"]
        ours = np.concatenate([R @ f for R, f in zip(turns, ours.reshape(-1, 3), strict=True)])
    J, _ = rows(model, data)
    assert np.abs(J.T @ ours - left).max() < APART * found.stance.robot.weight


def test_mujoco_stays_at_rest(case):
    """Its step with hard equalities, the motors' forces and the contacts' has no acceleration."""
    text, found = case
    model, data, _, force = shared(text, found)
    model.body_invweight0[:] *= 1e-9  # equalities as hard as they get
    model.dof_invweight0[:] *= 1e-9
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)  # rods beside shins
    model.actuator_gaintype[:], model.actuator_biastype[:] = 0, 0
    model.actuator_gainprm[:, 0] = 1.0
    model.actuator_ctrllimited[:] = 0
    data.ctrl[:] = force
    data.qfrc_applied[:] = contact_push(model, data, found)
    mujoco.mj_forward(model, data)
    assert np.abs(data.qacc).max() < 1e-4


def test_only_joints_with_an_actuator_have_motors():
    robot = copsense.load_robot(sprung_rods())
    assert set(robot.torque_names) == {
        *(f"{s}_{j}" for s in "lr" for j in ("yaw", "roll", "hip", "knee", "ankle_roll", "crank")),
        "shoulder",
    }
    assert robot.drives.springs == {
        "l_knee": Spring(30.0, np.radians(40)),
        "r_knee": Spring(30.0, np.radians(40)),
        "elbow": Spring(9.0, np.radians(-50)),
    }
    assert [note for note in robot.notes if "no motor" in note]
    assert not any("not used" in note for note in robot.notes)


def test_a_tendons_motors_are_a_transmission():
    robot = copsense.load_robot(coupled_and_tendons())
    assert robot.drives.couplings == (
        Coupling("r_yaw", "l_yaw", -0.8, np.radians(5) + 0.03 + 0.8 * np.radians(5)),
    )
    first = robot.drives.transmissions[0]
    assert first.motors == ("l_in_motor", "l_out_motor")
    assert first.joints == ("l_ankle_pitch", "l_ankle_roll")
    assert np.allclose(first.matrix, [[0.9, 1.1], [0.7, -0.6]])
    assert first.effort_limits == (60.0, 60.0)  # the tendon's force


WELDS = {
    "turned": "<weld body1='trunk' body2='forearm' anchor='.01 .02 .03' "
    "relpose='.1 0 .2 .9 .1 .3 .2'/>",
    "as it stands": "<weld body1='l_foot' body2='r_foot' anchor='0 .01 .02'/>",
    "sites": "<weld site1='l_heel' site2='r_heel'/>",
    "point": "<connect body1='forearm' body2='l_foot' anchor='.1 0 .2'/>",
}


@pytest.mark.parametrize("element", WELDS.values(), ids=WELDS)
def test_a_loop_is_open_as_far_as_mujoco_says(element):
    text = biped(tail=f"<equality>{element}</equality>")
    robot = copsense.load_robot(text)
    random = np.random.default_rng(1)
    q = robot.configuration({joint: float(random.normal()) for joint in robot.joint_names})
    stance = copsense.Stance(robot, q, [copsense.Contact("l_foot")], check=False)
    model, data = at_stance(text, stance)
    _, violated = rows(model, data)
    loop = robot.drives.loops[0]
    a, b = (
        frame_at(robot, q, frame, point)
        for frame, point in ((loop.frame_a, loop.offset_a), (loop.frame_b, loop.offset_b))
    )
    assert np.abs(violated[:3] - (a.translation - b.translation)).max() < 1e-9
    assert (loop.kind == "weld") == (len(violated) == 6)
    if loop.kind == "weld":
        angle = np.linalg.norm(pin.log3(b.rotation.T @ a.rotation))
        assert np.linalg.norm(violated[3:]) == pytest.approx(np.sin(angle / 2), abs=1e-9)


def test_an_equality_of_one_joint_pins_it_as_mujoco_does():
    text = biped(tail="<equality><joint joint1='l_hip' polycoef='-0.3 0.7 0 0 0'/></equality>")
    robot = copsense.load_robot(text)
    (coupling,) = robot.drives.couplings
    assert (coupling.joint, coupling.ratio) == ("l_hip", 0.0)
    random = np.random.default_rng(4)
    q = robot.configuration({joint: float(random.normal()) for joint in robot.joint_names})
    stance = copsense.Stance(robot, q, [copsense.Contact("l_foot")], check=False)
    model, data = at_stance(text, stance)
    _, violated = rows(model, data)
    off = robot.joint_position(q, "l_hip") - coupling.offset
    assert np.abs(violated).max() == pytest.approx(abs(off), abs=1e-12)
    # It cannot move, has no motor, and what holds it is the row's force.
    assert "l_hip" not in robot.torque_names
    index = robot.velocity_index("l_hip")
    closed = copsense.closing.close(robot, q)
    assert robot.joint_position(closed, "l_hip") == pytest.approx(coupling.offset, abs=1e-15)
    here = copsense.Stance(robot, closed, [copsense.Contact("l_foot")], check=False)
    assert np.abs(here.admissible_motions[index]).max() < 1e-12
