"""A batch gives what the reference gives, for every robot, contact and criterion."""

import numpy as np
import pytest
from support.stances import CASES, postures, served, weighed

import copsense
from copsense.batch import BatchKernel, evaluate_batch

RELATIVE = 1e-9
PER_CASE = 40  # times four criteria, ten cases; benchmarks/equality.py has 10 000 postures


def largest_error(given, expected):
    """Largest difference over rows (posture, criterion), relative to the row's largest entry."""
    shape = (given.shape[0] * given.shape[1], -1)
    a, b = given.reshape(shape), expected.reshape(shape)
    finite = np.isfinite(b)
    assert np.array_equal(a[~finite], b[~finite])
    sizes = np.abs(np.where(finite, b, 0.0)).max(axis=1, keepdims=True)
    errors = np.abs(np.where(finite, a, 0.0) - np.where(finite, b, 0.0))
    return float((errors / np.maximum(sizes, 1e-12)).max())


WEIGHED = ("icub", "icub, hand on a wall", "talos on slopes", "solo12 on three feet")


@pytest.mark.parametrize("name", CASES)
def test_the_kernel_equals_the_reference(case, name):
    equals_the_reference(case(name), served, PER_CASE)


@pytest.mark.parametrize("name", WEIGHED)
def test_references_and_full_weights_are_served_too(case, name):
    equals_the_reference(case(name), weighed, count=5)


def equals_the_reference(stance, choose, count):
    criteria = choose(stance)
    kernel = BatchKernel(stance, criteria)
    assert not kernel.fallback_reason
    assert not kernel.by_reference
    q = postures(stance, count)
    found = kernel.evaluate(q)
    assert not found.reasons
    for i, row in enumerate(q):
        here = stance.at(row)
        np.testing.assert_allclose(found.com[i], here.com, rtol=0, atol=1e-13)
        for j, criterion in enumerate(criteria):
            reference = copsense.cop_sensitivity(here, criterion)
            pairs = {
                "wrenches": reference.equilibrium.wrenches,
                "torques": reference.equilibrium.torques,
                "cops": reference.cop,
                "gradient": reference.gradient,
                "com_gain": reference.com_gain,
                "com_travel": reference.com_travel,
                "unloading_travel": reference.unloading_travel,
                "load_share": reference.equilibrium.wrenches[:, 2] / stance.robot.weight,
            }
            assert np.array_equal(found.tipping_edge[i, j], reference.tipping_edge)
            for what, value in pairs.items():
                error = largest_error(getattr(found, what)[i, j][None, None], value[None, None])
                assert error < RELATIVE, (what, i, criterion.name, error)


def test_margins_are_the_edge_margins(case):
    stance = case("icub")
    found = evaluate_batch(stance, postures(stance, 5), served(stance), gains=False)
    for i, j, k in np.ndindex(found.margin.shape):
        edge = copsense.polygon.Polygon(stance.contacts[k].polygon).margin(found.cops[i, j, k])
        assert found.margin[i, j, k] == pytest.approx(edge.distance, abs=1e-13)
    assert found.com_gain.size == found.com_travel.size == found.unloading_travel.size == 0


def test_every_kind_of_joint_is_served():
    stance = odd_joints()
    kernel = BatchKernel(stance, served(stance))
    assert not kernel.fallback_reason
    q = postures(stance, 10)
    found, reference = kernel.evaluate(q), reference_answers(stance, q)
    assert not found.reasons
    for what in ("wrenches", "torques", "gradient", "com_gain"):
        assert largest_error(getattr(found, what), getattr(reference, what)) < RELATIVE


def reference_answers(stance, q):
    kernel = BatchKernel(stance, served(stance))
    kernel.fallback_reason = "asked for"
    return kernel.evaluate(q)


def odd_joints():
    """The iCub with sliding knees and continuous shoulders and hips."""
    import pinocchio as pin

    source = copsense.load_stance("icub")
    model = pin.Model()
    for i in range(1, source.robot.model.njoints):
        old, name = source.robot.model.joints[i], source.robot.model.names[i]
        axis = np.zeros(3)
        if i > 1:
            data = source.robot.model.createData()
            J = pin.computeJointJacobians(source.robot.model, data, source.q)
            axis = pin.getJointJacobian(source.robot.model, data, i, pin.LOCAL)[3:, old.idx_v]
            assert J.shape[0] == 6
        if i == 1:
            joint = pin.JointModelFreeFlyer()
        elif "knee" in name:
            # It bends the leg no more, but lengthens it.
            joint = pin.JointModelPrismaticUnaligned(np.array([0.0, 0.6, 0.8]))
        elif "shoulder_yaw" in name or "hip_yaw" in name:
            joint = (pin.JointModelRUBX, pin.JointModelRUBY, pin.JointModelRUBZ)[
                int(np.argmax(np.abs(axis)))
            ]()
        else:
            joint = pin.JointModelRevoluteUnaligned(axis)
        parent, place = source.robot.model.parents[i], source.robot.model.jointPlacements[i]
        new = model.addJoint(parent, joint, place, name)
        model.appendBodyToJoint(new, source.robot.model.inertias[i], pin.SE3.Identity())
    for contact in source.contacts:
        frame = source.robot.frame(contact.frame)
        model.addFrame(
            pin.Frame(frame.name, frame.parentJoint, 0, frame.placement, pin.FrameType.OP_FRAME)
        )
    q = pin.neutral(model)
    old = source.robot.model
    for i in range(1, model.njoints):
        new, value = model.joints[i], source.q[old.joints[i].idx_q]
        if i == 1:
            q[:7] = source.q[:7]
        elif new.nq == 2:
            q[new.idx_q : new.idx_q + 2] = np.cos(value), np.sin(value)
        elif "knee" not in model.names[i]:
            q[new.idx_q] = value
    robot = copsense.Robot.from_model(model, name="odd")
    return copsense.Stance(robot, q, source.contacts)
