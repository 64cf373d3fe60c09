"""load_controller: a user's controller from ``MODULE:ATTRIBUTE``, a class or a function."""

from __future__ import annotations

import importlib
import inspect
import sys
from pathlib import Path
from typing import Any

import numpy as np

from copsense.arrays import check_name
from copsense.controllers.controller import Controller
from copsense.errors import ControllerError, InvalidInputError, UnknownNameError
from copsense.stance import Stance, check_stance


def controller_code(source: str) -> bytes:
    """The source of the module of ``MODULE:ATTRIBUTE``, without running it; empty if not found."""
    name, folder = _module(source.rpartition(":")[0])
    module = Path(*name.split("."))
    for where in (folder, *map(Path, sys.path)):
        for path in (where / module.with_suffix(".py"), where / module / "__init__.py"):
            if path.is_file():
                return path.read_bytes()
    return b""


def _module(given: str) -> tuple[str, Path]:
    """A module's name, and the folder to look in first."""
    path = Path(given)
    if path.suffix == ".py":
        return path.stem, path.parent.resolve()
    return given, Path.cwd()


def load_controller(source: str, stance: Stance) -> Controller:
    """A controller from ``MODULE:ATTRIBUTE``; the module is a name or the path of a file.

    Args:
        source: ``my_module:Mine`` or ``folder/my_module.py:Mine``: a class called with the stance,
            a function whose first parameter is ``stance`` and which returns a controller, or a
            function observation -> torques.
        stance: robot, contacts and posture to balance.

    Raises:
        InvalidInputError: not of that form, no such module, or not callable.
        UnknownNameError: the module has no such attribute.
        ControllerError: it raised when called with the stance; the message says what.
    """
    check_name(source, "the source of a controller")
    check_stance(stance)
    given, colon, attribute = source.rpartition(":")
    if not (given and colon and attribute):
        raise InvalidInputError(
            f"the controller {source!r} is not understood. Give MODULE:ATTRIBUTE, such as "
            "my_controller:MyController."
        )
    module_name, folder = _module(given)
    if given.endswith(".py") and not (folder / Path(given).name).is_file():
        raise InvalidInputError(
            f"there is no file {given} to read the controller from, seen from {Path.cwd()}. Give "
            "the path of a Python file, or the name of a module."
        )
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    try:
        module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise InvalidInputError(
            f"the controller's module {module_name!r} cannot be imported "
            f"({type(error).__name__}: {error}). Fix it, run the command in its folder, or install "
            "it."
        ) from error
    made: Any = getattr(module, attribute, None)
    if made is None:
        public = [
            name
            for name, value in vars(module).items()
            if callable(value) and getattr(value, "__module__", "") == module_name
        ]
        raise UnknownNameError(f"controller in {module_name!r}", attribute, public)
    if _takes_a_stance(made):
        try:
            made = made(stance)
        except (Exception, SystemExit) as error:
            raise ControllerError(
                f"{source} raised {type(error).__name__} when called with the stance: {error}. Fix "
                "it for this stance."
            ) from error
    if not callable(made) or isinstance(made, np.ndarray):
        raise InvalidInputError(
            f"{source} is {made!r}, not a controller. Give a callable observation -> torques."
        )
    return made


def _takes_a_stance(candidate: object) -> bool:
    if inspect.isclass(candidate):
        return True
    if not inspect.isfunction(candidate):
        return False
    return next(iter(inspect.signature(candidate).parameters), "") == "stance"
