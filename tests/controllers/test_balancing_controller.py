"""The torques of the balancing controller cause the wrenches it says, and move no foot."""

import numpy as np
import pinocchio as pin
import pytest
from support.standing import C1, C2, icub

import copsense
from copsense.controllers import BalancingController, Hold, Observation, lateral_reference


def contact_acceleration(stance, v, dv):
    """J dv + dJ v (m,), the second term by differences of J along v."""
    step = 1e-5

    def jacobian(h):
        q = pin.integrate(stance.robot.model, stance.q, h * v)
        return stance.at(q, check=False).jacobian

    drift = (jacobian(step) - jacobian(-step)) / (2 * step) @ v
    return stance.jacobian @ dv + drift, drift


@pytest.mark.parametrize("robot", ["icub", "solo12"])
@pytest.mark.parametrize("criterion", [C1, C2], ids=lambda c: c.name)
def test_torques_keep_moving_feet_in_place(robot, criterion):
    home = icub() if robot == "icub" else copsense.load_stance(robot)
    criterion = copsense.minimum_torque(tie_break=C1) if criterion is C2 else criterion
    controller = BalancingController(home, criterion)
    target = lateral_reference(home, Hold()).at(0.0)
    random = np.random.default_rng(4)
    model, wrenches = home.robot.model, np.zeros((len(home.contacts), 6))
    for _ in range(3):
        motion = home.admissible_motions @ random.uniform(
            -0.1, 0.1, home.admissible_motions.shape[1]
        )
        stance = copsense.posture.retract(home, motion)
        # Fast enough that the feet would leave the ground if their drift were forgotten.
        basis = stance.admissible_motions
        v = basis @ random.uniform(-3.0, 3.0, basis.shape[1])
        command = controller(Observation(0.0, stance.q, v, target, wrenches))
        # Independently: M dv + h = B tau + J' f.
        force = stance.jacobian.T @ stance.stack(command.wrenches)
        force[6:] += command.torques
        M = pin.crba(model, model.createData(), stance.q)
        bias = pin.nonLinearEffects(model, model.createData(), stance.q, v)
        dv = np.linalg.solve(M, force - bias)
        left, drift = contact_acceleration(stance, v, dv)
        assert np.abs(drift).max() > 0.05
        assert np.abs(left).max() < 1e-5 * np.abs(drift).max()
