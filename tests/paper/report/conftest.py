"""A small reproduction and its report, made once."""

import pytest
from support.reproductions import small_reproduction

from copsense.paper.report import write_report

COMMAND = "copsense reproduce --postures 21"


@pytest.fixture(scope="session")
def reproduction():
    return small_reproduction()


@pytest.fixture(scope="session")
def command():
    """The command that the report says it was made by."""
    return COMMAND


@pytest.fixture(scope="session")
def folder(reproduction, tmp_path_factory):
    """The folder of the report, which no test changes."""
    folder = tmp_path_factory.mktemp("written") / "report"
    assert write_report(reproduction, folder, command=COMMAND) == folder / "report.html"
    return folder
