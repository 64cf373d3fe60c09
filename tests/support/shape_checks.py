"""How the suite checks copsense's annotations: by beartype, as lenient as a type checker is.

To check every call takes longer than the calls themselves: of three seconds it makes nine, and to
prepare the checks of every function takes as long again. So a function's checks are prepared when
it is first called, and of its calls in one test the first and then some are checked.
"""

import dataclasses
import inspect
from collections import defaultdict
from collections.abc import Sequence
from functools import wraps
from typing import Any, get_args, get_origin

import jaxtyping
from beartype import BeartypeConf, FrozenDict, beartype
from numpy.typing import ArrayLike

FIRST, EVERY = 20, 23  # in one test the first so many calls, then every so many-th

# NumPy's protocol of a sequence asks for __reversed__, which a tuple does not have at run time.
_SEQUENCES = [
    m for m in get_args(ArrayLike) if "Sequence" in getattr(get_origin(m), "__name__", "")
]

check = beartype(
    conf=BeartypeConf(
        is_pep484_tower=True,  # an int serves as a float
        hint_overrides=FrozenDict(dict.fromkeys(_SEQUENCES, Sequence[Any])),
    )
)

# Calls in this test, by code: a function made within another is a new one at every call of that.
_calls = defaultdict(lambda: [0])


def install():
    """From here on, whatever is imported of copsense is checked."""
    # The decorator that the hook writes above every function and class.
    jaxtyping.jaxtyped = lambda typechecker: checked
    jaxtyping.install_import_hook("copsense", "support.shape_checks.check")


def begin_test():
    """From here on, calls are the first ones again."""
    for calls in _calls.values():
        calls[0] = 0


def checked(it):
    """A function whose calls are checked, or a dataclass whose initialiser is."""
    if inspect.isclass(it):
        if dataclasses.is_dataclass(it) and inspect.isfunction(vars(it).get("__init__")):
            it.__init__ = checked(it.__init__)
        return it
    calls, checking = _calls[it.__code__], None

    @wraps(it)
    def call(*arguments, **named):
        nonlocal checking
        calls[0] = number = calls[0] + 1
        if number > FIRST and number % EVERY:
            return it(*arguments, **named)
        if checking is None:
            checking = _jaxtyped(it, typechecker=check)
        return checking(*arguments, **named)

    return call


_jaxtyped = jaxtyping.jaxtyped  # the true one
