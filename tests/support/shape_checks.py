"""How the suite checks copsense's annotations: by beartype, as lenient as a type checker is.

To check every call takes longer than the calls themselves: of three seconds it makes nine, and to
prepare the checks of every function takes as long again. So a function's checks are prepared when
it is first called, and of its calls in one test the first and then some are checked.
"""

import dataclasses
import inspect
from collections import defaultdict
from collections.abc import Sequence
from functools import partial, wraps
from types import FunctionType, SimpleNamespace
from typing import Any, get_args, get_origin, get_type_hints

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
        violation_type=jaxtyping.TypeCheckError,
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
            checking = check(_with_known_hints(it))
        with _sizes():
            return checking(*arguments, **named)

    return call


# Within it a letter is one number, in all arguments and the answer. Jaxtyping's own decorator
# binds the arguments besides and checks each twice: as much work again.
_sizes = partial(jaxtyping.jaxtyped, "context")


def _with_known_hints(it):
    """A copy whose annotations are read: Any, where one names what type checkers alone import."""
    hints = _hints.get(it.__code__)
    if hints is None:
        hints = {name: _known(hint, it.__globals__) for name, hint in it.__annotations__.items()}
        if inspect.isgeneratorfunction(it):  # it yields when its call is over
            hints.pop("return", None)
        _hints[it.__code__] = hints
    copy = FunctionType(it.__code__, it.__globals__, it.__name__, it.__defaults__, it.__closure__)
    copy.__kwdefaults__, copy.__annotations__ = it.__kwdefaults__, hints
    copy.__module__, copy.__qualname__ = it.__module__, it.__qualname__
    return copy


def _known(hint, namespace):
    try:
        return get_type_hints(SimpleNamespace(__annotations__={"x": hint}), namespace)["x"]
    except NameError:
        return Any


_hints = {}  # by code
