"""The real command in a process of its own: start-up, exit codes, signals, closed output."""

import importlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

from copsense import cli
from copsense.cli.option_lists import SECTIONS

ENTRY = "from copsense.cli import main; main()"
COMMANDS = (
    "robots", "inspect", "analyse", "explore", "sweep", "plot", "map", "push", "design",
    "optimise", "hardware", "balance", "log", "identify", "benchmark", "four-bar", "reproduce",
)  # fmt: skip
HEAVY = {
    "numpy", "pinocchio", "scipy", "xarray", "pandas", "matplotlib", "jinja2", "netCDF4", "mujoco",
    "icub_models", "numba", "zarr", "distributed", "tqdm", "viser",
}  # fmt: skip


def run(*arguments, code=ENTRY, **options):
    options = {"capture_output": True, "text": True, "timeout": 120} | options
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], env=environment, **options
    )


def test_help_of_every_command_shows_an_example_and_loads_no_robot_and_no_plots():
    code = (
        "import sys, io, contextlib\n"
        "from copsense.cli import copsense\n"
        "texts = {}\n"
        f"for name in {COMMANDS!r}:\n"
        "    out = io.StringIO()\n"
        "    with contextlib.redirect_stdout(out):\n"
        "        copsense.main([name, '--help'], standalone_mode=False)\n"
        "    texts[name] = out.getvalue()\n"
        "import json\n"
        f"print(json.dumps([texts, sorted({HEAVY!r} & set(sys.modules))]))"
    )
    done = run(code=code)
    assert done.returncode == 0, done.stderr
    texts, heavy = json.loads(done.stdout)
    assert heavy == []
    for name, text in texts.items():
        assert re.search(rf"Examples?: copsense {name}", " ".join(text.split())), name
    assert list(texts) == list(importlib.import_module("copsense.cli").copsense.places)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_lists_every_option_once_a_command_s_own_first(name):
    command = cli.copsense.get_command(click.Context(cli.copsense), name)
    text = command.get_help(click.Context(command, info_name=name))
    heads = re.findall(r"^([A-Z][\w ]+):$", text, re.MULTILINE)
    assert heads[0] == "Options"
    assert heads[1:] == [section for section in SECTIONS if section in heads]
    listed = re.findall(r"^  (?:-\w, )?(--[\w-]+)", text, re.MULTILINE)
    options = [p for p in command.params if isinstance(p, click.Option)]
    known = [next(name for name in p.opts if name.startswith("--")) for p in options]
    assert sorted(listed) == sorted([*known, "--help"])
    if name == "analyse":
        assert heads[1:] == list(SECTIONS)
        assert "--along" in text.partition("Posture:")[0]
        assert "--sole" in text.partition("Contacts and ground:")[2].partition("Joints")[0]


def test_the_group_lists_every_command_without_importing_it():
    code = (
        "import sys\n"
        "from copsense.cli import copsense\n"
        "copsense.main(['--help'], standalone_mode=False)\n"
        "print([name for name in sys.modules if name.endswith('_command')])"
    )
    done = run(code=code)
    assert done.returncode == 0, done.stderr
    for name in COMMANDS:
        assert re.search(rf"^  {name} +\w", done.stdout, re.MULTILINE), name
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_installed_command_is_this_one():
    script = Path(sys.executable).with_name("copsense")
    if not script.exists():
        pytest.skip("the command is not installed beside this interpreter")
    done = subprocess.run([script, "--version"], capture_output=True, text=True)
    assert done.stdout.startswith("copsense, version ")


def test_exit_codes_are_0_done_1_some_rows_failed_2_bad_input():
    assert run("four-bar").returncode == 0
    some = run("sweep", "icub", "--com-y", "0:0.5:2")
    assert (some.returncode, "failed: posture 1" in some.stderr) == (1, True)
    bad = run("analyse", "icub", "--com-y", "0.5")
    assert (bad.returncode, bad.stdout) == (2, "")
    assert bad.stderr.splitlines()[-1].startswith("error: no posture of 'icub'")
    assert "Traceback" not in bad.stderr


def test_a_broken_urdf_is_one_line_without_a_parser_s_chatter(tmp_path):
    path = tmp_path / "half.urdf"
    path.write_text('<robot name="r"><link name="a"/><joint name="j" type="fixed"/></robot>')
    done = run("analyse", path)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1, done.stderr


def test_ctrl_c_in_the_middle_of_a_sweep_leaves_no_file(tmp_path):
    code = (
        "import importlib, itertools, signal\n"
        # A job in the background of a script is born deaf to it.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "module = importlib.import_module('copsense.sweeps')\n"
        "real, count = module.evaluate_row, itertools.count()\n"
        "def interrupted(*args):\n"
        "    if next(count) == 2: signal.raise_signal(signal.SIGINT)\n"
        "    return real(*args)\n"
        "module.evaluate_row = interrupted\n" + ENTRY
    )
    (tmp_path / "kept.nc").write_text("old")
    output = ("--output", tmp_path / "kept.nc", "--force")
    done = run("sweep", "four_bar", "--com-y", "0:0.01:5", *output, code=code)
    assert done.returncode == 130, done.stderr
    assert "Traceback" not in done.stderr
    assert "nothing half-written" in done.stderr
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("kept.nc", "old")]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_behind_the_answer_is_one_line():
    with Path("/dev/full").open("w") as full:
        done = run("four-bar", stdout=full, stderr=subprocess.PIPE, capture_output=False)
    assert done.returncode == 2
    assert "could not be printed" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_reader_that_leaves_early_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run("four-bar", stdout=writing, stderr=subprocess.PIPE, capture_output=False)
    finally:
        os.close(writing)
    assert done.returncode == 0
    assert "Traceback" not in done.stderr


def test_a_library_that_the_system_lacks_is_one_line():
    code = (
        "import sys, importlib.abc\n"
        "class Lacking(importlib.abc.MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'pinocchio':\n"
        "            raise ImportError('libgomp.so.1: cannot open shared object file')\n"
        "sys.meta_path.insert(0, Lacking())\n" + ENTRY
    )
    done = run("analyse", "icub", code=code)
    assert done.returncode == 2
    assert done.stderr.startswith("error: a package that copsense needs cannot be loaded: libgomp")
    assert "apt install libgomp1" in done.stderr
    assert done.stderr.count("\n") == 1
