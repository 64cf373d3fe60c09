"""What a shell completes: commands, options, robots known by name, files."""

import pytest
from click.shell_completion import BashComplete, FishComplete, ZshComplete

from copsense.cli import copsense
from copsense.robots import PRESETS


def completed(*words):
    """Values and kinds of what the last word is completed to."""
    shell = BashComplete(copsense, {}, "copsense", "_COPSENSE_COMPLETE")
    found = shell.get_completions(list(words[:-1]), words[-1])
    return [(item.value, item.type) for item in found]


def test_commands_and_options_are_completed():
    assert completed("an") == [("analyse", "plain")]
    assert ("--com-y", "plain") in completed("analyse", "icub", "--com")
    assert completed("balance", "icub", "--gains", "st") == [("stiff", "plain")]


@pytest.mark.parametrize("command", ["analyse", "inspect", "sweep", "benchmark"])
def test_a_robot_is_a_name_or_a_file(command):
    assert completed(command, "tal") == [("tal", "file"), ("talos", "plain")]
    assert completed(command, "./my") == [("./my", "file")]
    assert {name for name, kind in completed(command, "") if kind == "plain"} == set(PRESETS)


@pytest.mark.parametrize("shell", [BashComplete, ZshComplete, FishComplete])
def test_every_shell_gets_its_script(shell):
    script = shell(copsense, {}, "copsense", "_COPSENSE_COMPLETE").source()
    assert "_COPSENSE_COMPLETE=" in script
