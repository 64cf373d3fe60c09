"""MJCF as MuJoCo reads it: the robot of a scene as a ``pin.Model``, audited against the compiler.

With MuJoCo installed, everything comes from its compiled model: `compiled` reads the file,
`scene` finds the robot among what stands beside it, `tree_model` builds the ``pin.Model``,
`effort` its effort limits, `driving` its motors, springs, couplings and loops, `unused` says what
is left out, and `audit` compares. Without MuJoCo, `plain` reads the files that Pinocchio's own
reader is known to read right.
"""

from __future__ import annotations

import importlib.util

from copsense.description import Description
from copsense.mjcf.mjcf_reading import MjcfReading, MjcfShape


def read_mjcf(description: Description) -> MjcfReading:
    """The robot that an MJCF describes: model, collision shapes and notes.

    Raises:
        ModelLoadError: MuJoCo cannot compile it, or, without MuJoCo, it uses what Pinocchio's
            reader does not know; the message names it.
        InvalidInputError: several robots could be meant.
        UnknownNameError: no body is called as the root that was asked for.
    """
    if importlib.util.find_spec("mujoco") is None:
        from copsense.mjcf.plain import read_plain

        return read_plain(description)
    from copsense.mjcf.compiled import read_compiled

    return read_compiled(description)


def visible_shapes(description: Description) -> tuple[MjcfShape, ...] | None:
    """What MuJoCo's viewer shows of a robot at first, on the joints of its `MjcfReading`.

    None where MuJoCo is not installed. Compiles the file again: nothing else needs its triangles.
    """
    if importlib.util.find_spec("mujoco") is None:
        return None
    from copsense.mjcf.compiled import read_drawn

    return read_drawn(description)


__all__ = ["MjcfReading", "read_mjcf", "visible_shapes"]
