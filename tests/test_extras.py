"""Without an extra, what does not need it works, and what does names the line that installs it."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from copsense.errors import MissingExtraError
from copsense.extras import EXTRA_OF, require

# Everything that `pip install copsense` alone does not bring.
OPTIONAL = (*EXTRA_OF, "icub_models")
# SciPy looks at these in sys.modules, and takes what it finds for the package.
SEEN_BY_SCIPY = {"jax", "torch"}
BLOCK = "import sys; sys.modules.update(dict.fromkeys({}))\n"
FOUR_BAR = "import copsense; s = copsense.load_stance('four_bar')\n"
PATH = FOUR_BAR + "p = copsense.lateral_sweep(s, 0.0, 0.01, 2)\n"
CRITERIA = "[copsense.minimum_wrench(1.0)]"


INSTALLED_AS = {"collada": "pycollada"}  # where the name is another than that of the import


def run(code, *missing):
    blocked = BLOCK.format(list(missing))
    return subprocess.run([sys.executable, "-c", blocked + code], capture_output=True, text=True)


def test_the_command_and_the_analysis_of_a_robot_need_no_extra():
    command = "from copsense.cli import main; sys.argv = {}; main()"
    blocked = [package for package in OPTIONAL if package not in SEEN_BY_SCIPY]
    done = run(command.format(["copsense", "analyse", "four_bar", "--json"]), *blocked)
    assert done.returncode == 0, done.stderr
    limited = "copsense.analyse(s, limits=copsense.Limits(friction=0.5))\n"
    done = run(FOUR_BAR + limited + "copsense.design\n", *blocked)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("package", "code"),
    [
        ("xarray", PATH + f"copsense.sweep(p, {CRITERIA})"),
        ("netCDF4", PATH + f"copsense.sweep(p, {CRITERIA}).save('x.nc')"),
        ("pandas", FOUR_BAR + f"copsense.analyse(s, {CRITERIA}).to_pandas()"),
        ("matplotlib", FOUR_BAR + f"copsense.analyse(s, {CRITERIA}).plot()"),
        ("jinja2", "import copsense.paper.report"),
        ("pandas", "import copsense.comparison"),
        ("mujoco", "import copsense; copsense.balance(copsense.load_stance('solo12'))"),
        ("xarray", "import copsense; copsense.map_postures"),
        ("torch", "import copsense.torch"),
        ("jax", "import copsense.jax"),
    ],
)
def test_a_missing_extra_names_the_line_that_installs_it(package, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run(code, package)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("copsense.errors.MissingExtraError: ")
    assert f'pip install "copsense[{EXTRA_OF[package]}]"' in last
    assert list(tmp_path.iterdir()) == []


def test_figures_need_nothing_of_another_extra():
    others = [p for p, extra in EXTRA_OF.items() if extra != "plots" and p not in SEEN_BY_SCIPY]
    done = run(FOUR_BAR + f"copsense.analyse(s, {CRITERIA}).plot()", *others)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("extra", "arguments"),
    [
        ("plots", "analyse four_bar --plot {}/x.png"),
        ("map", "map four_bar --over com_y=0:0.01:2 --output {}/x.zarr"),
    ],
)
def test_a_missing_extra_is_one_line_of_the_command(extra, arguments, tmp_path):
    code = "from copsense.cli import main; sys.argv = {}; main()"
    words = ["copsense", *arguments.format(tmp_path).split()]
    lacking = {"plots": ["matplotlib"], "map": ["xarray", "zarr"]}[extra]
    done = run(code.format(words), *lacking)
    assert done.returncode == 2
    errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert f'pip install "copsense[{extra}]"' in errors[0]


def test_every_optional_package_is_in_the_extra_that_its_error_names():
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))
    extras = project["project"]["optional-dependencies"]
    for package, extra in EXTRA_OF.items():
        names = [re.split(r"[\[><=]", need)[0] for need in extras[extra]]
        assert INSTALLED_AS.get(package, package.replace("_", "-")) in names, package
    whole = extras["all"][0]
    apart = {"all", "gpu", "icub", "jax", "torch"}
    assert {name for name in extras if name not in apart} == set(re.findall(r"\w+", whole)[1:])


def test_require_passes_what_is_installed():
    require("xarray", "a sweep")
    with pytest.raises(KeyError):
        require("a_package_that_no_extra_has", "nothing")


def test_the_error_is_an_import_error_that_carries_its_data():
    error = MissingExtraError("xarray", "data", "a sweep")
    assert isinstance(error, ImportError)
    assert (error.package, error.extra, error.purpose) == ("xarray", "data", "a sweep")
