"""Devices: where a batch may be evaluated, and whether it can be there."""

from __future__ import annotations

from copsense.errors import InvalidInputError
from copsense.extras import require

DEVICES = ("cpu", "cuda")


def is_on_device(device: object) -> bool:
    """Whether a batch goes to a graphics processor, which is there and can be used.

    Raises:
        InvalidInputError: none that can be used, or a name that is not in `DEVICES`.
        MissingExtraError: what compiles for it is not installed.
    """
    if not (isinstance(device, str) and device in DEVICES):
        raise InvalidInputError(f"device is {device!r}. Give one of {', '.join(DEVICES)}.")
    if device == "cpu":
        return False
    require("numba_cuda", "evaluating on a graphics processor")
    from copsense.batch.device import why_absent

    if reason := why_absent():
        raise InvalidInputError(
            f'device is "cuda", and no such device can be used: {reason} `nvidia-smi` lists what '
            'NVIDIA\'s driver sees. Leave device out, or give "cpu", to evaluate on the processor.'
        )
    return True
