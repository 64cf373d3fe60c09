"""A build of the documentation takes minutes, and says what it does meanwhile."""

import runpy
from pathlib import Path

import pytest

pytest.importorskip("sphinx_gallery")

CONF = Path(__file__).parents[2] / "docs" / "conf.py"


class Build:
    """What Sphinx does with events: those who listen are called in order of their priority."""

    def __init__(self):
        self.listeners = []

    def connect(self, event, listener, priority=500):
        self.listeners.append((priority, event, listener))

    def emit(self, event, *arguments):
        for _, of, listener in sorted(self.listeners, key=lambda each: each[0]):
            if of == event:
                assert listener(self, *arguments) is None  # Sphinx takes values for page names


def test_a_build_says_each_stage_and_its_seconds(capsys):
    build = Build()
    conf = runpy.run_path(str(CONF))
    conf["show_stages"](build)
    build.connect("build-finished", lambda *_: said.extend(capsys.readouterr().out.splitlines()))
    said = []
    for event, *arguments in (
        ("builder-inited",),
        ("env-before-read-docs", None, []),
        ("write-started", None),
        ("build-finished", None),
    ):
        build.emit(event, *arguments)
        said += capsys.readouterr().out.splitlines()
    examples, pages, writing, scenes = (f"{name} ..." for *_, name in conf["STAGES"] if name)
    second = "  0 s"
    assert said == [examples, second, pages, second, writing, second, scenes, second]
