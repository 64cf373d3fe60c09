"""A reproduction with few postures, computed once for every test that looks at one."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

from copsense.paper.report import report_figures, report_files
from copsense.paper.reproduce import reproduce_paper
from copsense.reports import report_folder

POSTURES = 21


@cache
def small_reproduction():
    return reproduce_paper(postures=POSTURES)


def blank_pictures(monkeypatch):
    """Reports have pictures that cost nothing, for tests that are not about them."""

    def figures(reproduction):
        return [replace(figure, draw=SimpleNamespace) for figure in report_figures(reproduction)]

    monkeypatch.setattr(report_files, "report_figures", figures)
    monkeypatch.setattr(report_files, "report_scenes", lambda reproduction: ())
    monkeypatch.setattr(report_folder, "lay_out", lambda figure: None)
    monkeypatch.setattr(report_folder, "render_figure", lambda figure, suffix: b"<svg/>")
