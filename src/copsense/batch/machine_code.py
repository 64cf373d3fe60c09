"""Machine code: how long it is waited for, and why it does not travel with what holds it."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

# Of one kernel, once on a machine.
COMPILING_TAKES = "half a minute, or up to two minutes on a busy machine"


def writeable(parts: Any) -> Any:
    """A named tuple with arrays of its own, as copies have them too.

    Machine code is of types: given a read-only array, a kernel would be compiled once more.
    """
    made = (np.array(p, order="C") if isinstance(p, np.ndarray) else p for p in parts)
    return type(parts)(*made)


class HoldsMachineCode:
    """What keeps machine code, which belongs to a process: a copy looks it up when first used."""

    _of_this_process: ClassVar[tuple[str, ...]] = ("_code",)

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled."""
        return self.__dict__ | dict.fromkeys(self._of_this_process)
