"""compiled: an MJCF through MuJoCo's compiler, then as a ``pin.Model``."""

from __future__ import annotations

import warnings
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from copsense.description import Description
from copsense.errors import InvalidInputError, ModelLoadError
from copsense.mjcf.audit import check_against
from copsense.mjcf.collision import collision_shapes, drawn_shapes
from copsense.mjcf.driving import read_drives
from copsense.mjcf.effort import effort_limits
from copsense.mjcf.gravity import usable_gravity
from copsense.mjcf.mjcf_reading import MjcfReading, MjcfShape
from copsense.mjcf.scene import find_robot, left_out
from copsense.mjcf.tree_model import build_tree, pose
from copsense.mjcf.unused import unused

_UNNAMED = "MuJoCo Model"  # what MuJoCo calls a model without a name


def read_compiled(description: Description) -> MjcfReading:
    """The robot of an MJCF as MuJoCo compiles it; see `copsense.mjcf.read_mjcf`."""
    mj, name, warned = compile_mjcf(description)
    if mj.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY):
        mj.opt.gravity[:] = 0.0
    try:
        root = find_robot(mj, description.frames, description.root)
        tree = build_tree(mj, root)
    except (InvalidInputError, ModelLoadError) as error:
        raise type(error)(f"{_what(description)}: {error}") from None
    gravity, said = usable_gravity(np.array(mj.opt.gravity))
    tree.model.gravity = pin.Motion(gravity, np.zeros(3))
    tree.model.name = name or mj.body(root).name or "robot"
    tree.model.upperEffortLimit = effort_limits(mj, tree)
    tree.model.lowerEffortLimit = -tree.model.upperEffortLimit
    check_against(mj, tree)
    drives, assumed = read_drives(mj, tree)
    notes = (*warned, *said, *left_out(mj, root), *unused(mj, tree), *assumed)
    base = np.array(pose(np.zeros(3), mj.body_quat[root]).rotation)
    return MjcfReading(tree.model, collision_shapes(mj, tree), notes, drives, base)


def read_drawn(description: Description) -> tuple[MjcfShape, ...]:
    """What is seen of the robot of an MJCF; see `copsense.mjcf.visible_shapes`."""
    mj, _, _ = compile_mjcf(description)
    root = find_robot(mj, description.frames, description.root)
    return drawn_shapes(mj, build_tree(mj, root))


def compile_mjcf(description: Description) -> tuple[Any, str, tuple[str, ...]]:
    """The ``mujoco.MjModel`` of an MJCF, the name the file gives it, and the compiler's warnings.

    Raises:
        ModelLoadError: MuJoCo rejects it; the message is MuJoCo's.
    """
    said: list[str] = []
    before = mujoco.get_mju_user_warning()
    # By default MuJoCo writes its warnings to a file in the current folder.
    mujoco.set_mju_user_warning(said.append)
    try:
        spec = (
            mujoco.MjSpec.from_string(description.text)
            if description.path is None
            else mujoco.MjSpec.from_file(str(description.path))
        )
        with warnings.catch_warnings(record=True) as raised:
            warnings.simplefilter("always")
            model = spec.compile()
        said += [str(one.message) for one in raised]
    except (ValueError, mujoco.FatalError) as error:
        reason = ", ".join(line.strip() for line in str(error).strip().splitlines())
        reason = reason.removeprefix("XML ").removeprefix("Error: ").rstrip(".")
        raise ModelLoadError(
            f"{_what(description)} is not a readable MJCF, says MuJoCo: {reason}. Correct the file."
        ) from None
    finally:
        mujoco.set_mju_user_warning(before)
    name = "" if spec.modelname == _UNNAMED else str(spec.modelname)
    return model, name, tuple(f"MuJoCo warns: {text.strip()}" for text in dict.fromkeys(said))


def _what(description: Description) -> str:
    return str(description.path or "the text given")
