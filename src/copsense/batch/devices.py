"""Devices: where a batch may be evaluated, and whether it can be there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from copsense.errors import CopsenseError, InvalidInputError
from copsense.extras import require

DEVICES = ("cpu", "cuda")
_COMPILERS = ("NVRTC", "NVVM", "libdevice", "nvJitLink")
_LONG = 160  # characters of an error of CUDA's
_ELSE = 'Leave device out, or give "cpu", to evaluate on the processor.'


def is_on_device(device: object) -> bool:
    """Whether a batch goes to a graphics processor, which is there and can be used.

    Raises:
        InvalidInputError: none that can be used, or nothing that compiles for it, or a name that is
            not in `DEVICES`.
        MissingExtraError: what compiles for it is not installed.
    """
    if not (isinstance(device, str) and device in DEVICES):
        raise InvalidInputError(f"device is {device!r}. Give one of {', '.join(DEVICES)}.")
    if device == "cpu":
        return False
    require("numba_cuda", "evaluating on a graphics processor")
    with compiling():
        from copsense.batch.device import why_absent

    if reason := why_absent():
        raise InvalidInputError(
            f'device is "cuda", and no such device can be used: {reason} `nvidia-smi` lists what '
            f"NVIDIA's driver sees. {_ELSE}"
        )
    return True


@contextmanager
def compiling() -> Iterator[None]:
    """Say in one error what CUDA's compilers lack, where a function is compiled for a device.

    Numba and the packages below it load NVRTC and NVVM when they are first needed, and raise errors
    of many kinds: ImportError and RuntimeError, or of their own.

    Raises:
        InvalidInputError: a compiler is missing, or does not fit driver and device.
    """
    try:
        yield
    except CopsenseError:
        raise
    except Exception as error:
        kind = type(error)
        own = kind.__module__.startswith(("cuda.", "numba.cuda"))
        if not (own or isinstance(error, ImportError | OSError | RuntimeError)):
            raise
        said = " ".join(str(error).split()).rstrip(".") or kind.__name__
        said = said if len(said) <= _LONG else said[:_LONG] + " ..."
        part = next((f" ({name})" for name in _COMPILERS if name.lower() in said.lower()), "")
        missing = isinstance(error, ImportError | OSError) or "NotFound" in kind.__name__
        raise InvalidInputError(
            f'device is "cuda", and CUDA\'s compiler{part} '
            f"{'is missing' if missing else 'does not serve this device'} ({said}). "
            'pip install "copsense[gpu]" brings that of CUDA 12; `nvidia-smi` says which CUDA the '
            f"driver serves. {_ELSE}"
        ) from error
