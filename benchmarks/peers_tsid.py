"""tsid as a balancing controller; started by peers.py, see peers_pipe.py.

Task-space inverse dynamics in one QP: dynamics and feet as equations, CoM, posture and the
regularisation of the contact forces (which is the minimum wrench) as weighted costs. Its contacts
are always unilateral, within friction and within four corner points; without limits those points
are moved so far out that they never matter.
"""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np
import pinocchio as pin
from peers_pipe import State, Step, Times, clock, serve
from tsid import tsid_pywrap as tsid

COM, POSTURE, FORCE = 1e4, 1.0, 1e-4  # weights: the posture yields to the CoM
FAR, GRIP = 1.0, 10.0  # half of a sole [m] and its friction, without limits
MOST = 1e6  # N
KEPT: list[Any] = []  # tsid's objects hold each other by bare references


def build(setup: dict[str, Any]) -> tuple[dict[str, Any], Step]:
    """The robot and the problem."""
    model = pin.buildModelFromXML(setup["urdf"], pin.JointModelFreeFlyer())
    joints = list(model.names)[2:]
    place = dict(zip(setup["joints"], setup["start"][7:], strict=True))
    q = np.array(setup["start"][:7] + [place.get(joint, 0.0) for joint in joints])
    hello = {
        "joints": joints,
        "mass": pin.computeTotalMass(model),
        "com": list(pin.centerOfMass(model, model.createData(), q)),
        "versions": [f"{name} {version(name)}" for name in ("tsid", "pin", "numpy")],
    }
    robot = tsid.RobotWrapper(model, tsid.RootJointType.FLOATING_BASE_SYSTEM, False)
    problem = tsid.InverseDynamicsFormulationAccForce("balance", robot, False)
    problem.computeProblemData(0.0, q, np.zeros(model.nv))
    gains, limits = setup["gains"], setup["limits"]
    contacts = []
    for contact in setup["contacts"]:
        (x, y, z), (length, across) = contact["offset"], contact["size"]
        if limits:
            a, b = length / 2 - limits["margin"], across / 2 - limits["margin"]
        else:
            x = y = z = 0.0
            a = b = FAR
        points = np.array([[x - a, x - a, x + a, x + a], [y - b, y + b, y - b, y + b], [z] * 4])
        friction, least = (limits["friction"], limits["force"]) if limits else (GRIP, 0.0)
        foot = tsid.Contact6d(
            contact["name"],
            robot,
            contact["name"],
            points,
            np.array([0.0, 0, 1]),
            friction,
            least,
            MOST,
        )
        foot.setKp(np.zeros(6))
        foot.setKd(np.zeros(6))
        foot.setReference(robot.framePosition(problem.data(), model.getFrameId(contact["name"])))
        foot.setForceReference(np.zeros(6))
        foot.setRegularizationTaskWeightVector(np.ones(6))
        problem.addRigidContact(foot, FORCE)
        contacts.append(foot)
    com = tsid.TaskComEquality("com", robot)
    com.setKp(gains["com"][0] * np.ones(3))
    com.setKd(gains["com"][1] * np.ones(3))
    problem.addMotionTask(com, COM, 1, 0.0)
    posture = tsid.TaskJointPosture("posture", robot)
    posture.setKp(gains["posture"][0] * np.ones(len(joints)))
    posture.setKd(gains["posture"][1] * np.ones(len(joints)))
    problem.addMotionTask(posture, POSTURE, 1, 0.0)
    solver = tsid.SolverHQuadProgFast("solver")
    solver.resize(problem.nVar, problem.nEq, problem.nIn)
    com_sample, posture_sample = tsid.TrajectorySample(3), tsid.TrajectorySample(len(joints))
    n = len(joints)

    KEPT.extend([model, robot, problem, com, posture, solver, contacts])

    def step(state: State) -> tuple[Times, np.ndarray, np.ndarray]:
        called = clock()
        com_sample.value(state.com)
        com_sample.derivative(state.com_velocity)
        com_sample.second_derivative(state.com_acceleration)
        posture_sample.value(state.posture[7:])
        posture_sample.derivative(state.velocity[6:])
        posture_sample.second_derivative(np.zeros(n))
        com.setReference(com_sample)
        posture.setReference(posture_sample)
        q, v = state.q.copy(), state.v.copy()
        began = clock()
        data = problem.computeProblemData(state.time, q, v)
        middle = clock()
        solution = solver.solve(data)
        torques = problem.getActuatorForces(solution)
        ended = clock()
        if solution.status != 0:
            raise RuntimeError(f"the solver says {solution.status} at {state.time:.3f} s")
        wrenches = np.array(
            [
                foot.getForceGeneratorMatrix @ problem.getContactForce(foot.name, solution)
                for foot in contacts
            ]
        )
        return (clock() - called, ended - began, ended - middle), np.array(torques), wrenches

    return hello, step


if __name__ == "__main__":
    serve(build)
