"""The package's front: few names, imported when used; modules that functions do not hide."""

import ast
import importlib
import importlib.util
import pkgutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import copsense

ROOT = Path(copsense.__file__).parent
HEAVY = ("numpy", "pinocchio", "scipy", "xarray", "pandas", "matplotlib", "numba", "mujoco")


def type_checker_imports():
    """Name -> module, as the TYPE_CHECKING block says."""
    tree = ast.parse((ROOT / "__init__.py").read_text("utf-8"))
    block = next(
        node
        for node in tree.body
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
    )
    return {alias.name: node.module for node in block.body for alias in node.names}


def test_the_front_has_few_names_and_type_checkers_see_the_same():
    assert len(copsense.__all__) <= 40
    assert type_checker_imports() == copsense._HOME_OF
    assert set(copsense.__all__) == {*copsense._HOME_OF, "__version__"}


@pytest.mark.parametrize("name", sorted(set(copsense.__all__) - {"__version__"}))
def test_a_public_name_is_that_of_its_module(name):
    home = importlib.import_module(copsense._HOME_OF[name])
    assert getattr(copsense, name) is getattr(home, name)
    assert name in dir(copsense)


def test_modules_are_imported_when_they_are_first_asked_for():
    code = (
        "import sys, copsense\n"
        f"print([name for name in {HEAVY} if name in sys.modules])\n"
        "print(copsense.cop.contact_cops.__module__)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "copsense.cop"]


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'sweeep'"):
        _ = copsense.sweeep
    assert not hasattr(copsense, "__wrapped__")


def modules():
    left_out = {"copsense.__main__"}
    if importlib.util.find_spec("torch") is None:  # not brought by the development tools
        left_out.add("copsense.torch")
    return [
        found.name
        for found in pkgutil.walk_packages(copsense.__path__, "copsense.")
        if found.name not in left_out
    ]


def test_no_function_hides_a_module():
    hidden = set()
    for name in modules():
        module = importlib.import_module(name)
        package, _, short = name.rpartition(".")
        if getattr(sys.modules[package], short) is not module:
            hidden.add(name)
    assert hidden == set()


def test_a_file_name_occurs_once():
    names = Counter(path.name for path in ROOT.rglob("*.py") if path.name != "__init__.py")
    assert {name for name, times in names.items() if times > 1} == set()
