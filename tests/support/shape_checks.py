"""How the suite checks copsense's annotations: by beartype, as lenient as a type checker is.

To check every call takes longer than the calls themselves: of three seconds it makes nine, and to
prepare the checks of every function takes as long again. So a function's checks are prepared when
it is first called, and of its calls in one test the first and then some are checked.
"""

import dataclasses
import inspect
from collections import defaultdict
from collections.abc import Sequence
from functools import cache, partial, update_wrapper
from types import FunctionType, SimpleNamespace
from typing import Any, get_args, get_origin, get_type_hints

import jaxtyping
import numpy as np
from beartype import BeartypeConf, FrozenDict, beartype
from numpy.typing import ArrayLike

FIRST, EVERY = 20, 23  # in one test the first so many calls, then every so many-th

# NumPy's protocol of a sequence asks for __reversed__, which a tuple does not have at run time.
_SEQUENCES = [
    m for m in get_args(ArrayLike) if "Sequence" in getattr(get_origin(m), "__name__", "")
]
_LENIENT: dict[Any, Any] = dict.fromkeys(_SEQUENCES, Sequence[Any])
if not _SEQUENCES:  # from NumPy 2.5 on ArrayLike is an alias of aliases, replaced as a whole
    _LENIENT[ArrayLike] = np.ndarray | np.generic | Sequence[Any] | complex | bytes

check = beartype(
    conf=BeartypeConf(
        is_pep484_tower=True,  # an int serves as a float
        violation_type=jaxtyping.TypeCheckError,
        hint_overrides=FrozenDict(_LENIENT),
    )
)

# By code, as a function made within another is a new one at every call of that: how many of the
# next calls are not checked, and how many of this test were.
_turns = defaultdict(lambda: [0, 0])
_counted = []  # those that are not as at the beginning of a test


def install():
    """From here on, whatever is imported of copsense is checked."""
    # The decorator that the hook writes above every function and class.
    jaxtyping.jaxtyped = lambda typechecker: checked
    jaxtyping.install_import_hook("copsense", "support.shape_checks.check")


def begin_test():
    """From here on, calls are the first ones again."""
    for turn in _counted:
        turn[:] = 0, 0
    _counted.clear()


def checked(it):
    """A function whose calls are checked, or a dataclass whose initialiser is."""
    if inspect.isclass(it):
        if dataclasses.is_dataclass(it) and inspect.isfunction(vars(it).get("__init__")):
            it.__init__ = checked(it.__init__)
        return it
    turn, checking = _turns[it.__code__], None

    def check_this_one(*arguments, **named):
        nonlocal checking
        if not turn[1]:
            _counted.append(turn)
        turn[1] += 1
        turn[0] = 0 if turn[1] < FIRST else EVERY - 1
        if checking is None:
            checking = check(_with_known_hints(it))
        with _sizes():
            return checking(*arguments, **named)

    return update_wrapper(_passing_on(it, turn, check_this_one), it)


def _passing_on(it, turn, check_this_one):
    """A function that passes its arguments on, or has them checked."""
    code = it.__code__
    if it.__defaults__ or it.__kwdefaults__ or code.co_flags & _GATHERS:

        def call(*arguments, **named):
            if turn[0]:
                turn[0] -= 1
                return it(*arguments, **named)
            return check_this_one(*arguments, **named)

        return call
    return _by_name(code)(it, turn, check_this_one)


_GATHERS = inspect.CO_VARARGS | inspect.CO_VARKEYWORDS


@cache
def _by_name(code):
    """The same for functions of this code: to gather and spread arguments takes longer."""
    last = code.co_argcount
    positional, named = code.co_varnames[:last], code.co_varnames[last:][: code.co_kwonlyargcount]
    takes, gives = list(positional), [*positional, *(f"{name}={name}" for name in named)]
    if code.co_posonlyargcount:
        takes.insert(code.co_posonlyargcount, "/")
    takes += ["*", *named] if named else []
    text = f"""
def passing_on(__it, __turn, __check):
    def call({", ".join(takes)}):
        if __turn[0]:
            __turn[0] -= 1
            return __it({", ".join(gives)})
        return __check({", ".join(gives)})
    return call
"""
    made = {}
    exec(compile(text, __file__, "exec"), made)
    return made["passing_on"]


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
