"""Robots in closed loop: simulators, scenarios, and the recording of a controller's run."""

from copsense.simulation.balance_run import balance
from copsense.simulation.control_loop import rollout
from copsense.simulation.disturbance import FrictionChange, ModelError, Motors, Noise, Push
from copsense.simulation.events import Event, Thresholds
from copsense.simulation.mujoco_simulator import MujocoSimulator
from copsense.simulation.odometry import FootOdometry
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.simulation.recording import Recording
from copsense.simulation.scenario import Scenario
from copsense.simulation.simulator import (
    AlterableSimulator,
    RepeatingSimulator,
    Simulator,
    SimulatorStoppedError,
    Snapshot,
)

__all__ = [
    "AlterableSimulator",
    "Event",
    "FootOdometry",
    "FrictionChange",
    "ModelError",
    "Motors",
    "MujocoSimulator",
    "Noise",
    "PhysicsSettings",
    "Push",
    "Recording",
    "RepeatingSimulator",
    "Scenario",
    "Simulator",
    "SimulatorStoppedError",
    "Snapshot",
    "Thresholds",
    "balance",
    "rollout",
]
