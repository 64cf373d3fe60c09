"""Tutorials do what they show: each command in an empty folder, with its output."""

from pathlib import Path

import pytest
from support.commands import copsense
from support.sessions import Reader, Step, difference, same_line, steps

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
PAGES += [ROOT / "docs" / name for name in ("index.md", "coming_from.md", "cheat_sheet.md")]


def run(*arguments):
    answer = copsense(*arguments, together=True)
    return answer.code, answer.out


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_prints_what_it_shows(page, tmp_path, monkeypatch):
    # What is slow here, tools/try_wheel.py runs and compares.
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    reader = Reader(tmp_path, run)
    for step in steps(page):
        if step.slow:
            continue
        said = reader.follow(step)
        assert not step.shown or not difference(step.shown, said), difference(step.shown, said)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_shows_what_its_commands_print(page):
    shown = [step for step in steps(page) if step.shown]
    assert shown or page.stem in ("coming_from", "cheat_sheet")
    assert not [step.text for step in shown if "?" in step.shown.splitlines()]


def test_a_page_is_read_as_its_reader_would(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "```console\n$ a \\\n    --b  # why\nout\n\nmore\n$ c\n```\n"
        "```sh\n# nothing\nd --e\n```\n"
        "```toml\n# x.toml\nk = 1\n```\n"
        "```python slow\nf()\n```\n"
    )
    found = list(steps(page))
    assert [(s.kind, s.text, s.shown, s.slow) for s in found] == [
        ("command", "a --b", "out\n\nmore\n", False),
        ("command", "c", "", False),
        ("command", "d --e", "", False),
        ("file", "# x.toml\nk = 1\n", "", False),
        ("python", "f()\n", "", True),
    ]
    first, last = found[0].span
    assert page.read_text()[first:last] == "out\n\nmore\n"


@pytest.mark.parametrize(
    ("shown", "said", "same"),
    [
        ("a 1.50 mm", "a  1.51 mm", True),
        ("a 1.50 mm", "a 1.52 mm", False),
        ("residual 8.5e-14 N", "residual 2.1e-13 N", True),
        ("load 0.5", "loads 0.5", False),
        ("25 postures", "26 postures", False),
        ("+0.00, -0.0", "-0.01, 0.2", False),
        ("first\n...\nlast 2.0", "first\nsecond\nthird\nlast 2.1", True),
        ("first\n...\nlast", "zeroth\nfirst\nlast", False),
        ("first\n...", "first\nlast", True),
        ("one", "one\ntwo", False),
        ("one\ntwo", "one", False),
    ],
)
def test_outputs_are_the_same_to_the_last_digit_that_is_shown(shown, said, same):
    assert (not difference(shown, said)) == same
    if "\n" not in shown + said:
        assert same_line(shown, said) == same


def test_a_command_that_fails_where_the_page_shows_no_error_is_found(tmp_path):
    reader = Reader(tmp_path, run)
    with pytest.raises(AssertionError, match="ended with 2"):
        reader.follow(Step("command", "copsense analyse nowhere.urdf"))
    assert reader.follow(
        Step("command", "copsense analyse nowhere.urdf", shown="error: no file ...\n")
    ).startswith("error: no file at 'nowhere.urdf'")
