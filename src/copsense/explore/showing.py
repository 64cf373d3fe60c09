"""show: a result in 3-D, in a notebook or as a page."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from copsense.analysis import Analysis
from copsense.arrays import check_type
from copsense.content import ShortRepr
from copsense.criterion import Criterion, minimum_torque, minimum_wrench
from copsense.errors import InvalidInputError
from copsense.explore.export import RATE, page_of
from copsense.explore.model import Model
from copsense.explore.playback import recording_run, sweep_run
from copsense.explore.played_model import PlayedModel
from copsense.files import check_output, write_beside
from copsense.limits import Limits
from copsense.logs import LogComparison
from copsense.optimisation import Optimum
from copsense.posture_run import PostureRun
from copsense.simulation import Recording
from copsense.stance import Stance
from copsense.sweeps import Sweep

Subject = Stance | Analysis | PostureRun | LogComparison | Optimum | Recording | Sweep
_MADE_OF = (Recording, Sweep)  # do not hold the stance they were made of


@dataclass(frozen=True, repr=False)
class ShownPage(ShortRepr):
    """A result in 3-D: the last line of a notebook's cell shows it, `save` writes it.

    Attributes:
        html: a page that needs no other file and no network.
        height: of the frame that shows it in a notebook [pixels].
    """

    html: str
    height: int

    def _repr_html_(self) -> str:
        return (
            f'<iframe sandbox="allow-scripts" title="in 3-D" srcdoc="{html.escape(self.html)}" '
            f'style="width:100%;height:{self.height}px;border:0"></iframe>'
        )

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the page.

        Args:
            path: a file in ``.html``.
            overwrite: whether an existing file may be replaced.

        Raises:
            OutputError: it is there already, or cannot be written.
        """
        target = check_output(path, suffixes=(".html",), overwrite=overwrite)
        write_beside(target, lambda place: place.write_text(self.html, encoding="utf-8"))
        return target


def show(
    subject: Subject,
    stance: Stance | None = None,
    *,
    criteria: Sequence[Criterion] | None = None,
    limits: Limits | None = None,
    meshes: bool = False,
    height: int = 840,
    rate: float = RATE,
    advance: Callable[[int], object] = lambda _: None,
) -> ShownPage:
    """Show a result in 3-D: a posture as a picture to turn, a run of postures as a film.

    Args:
        subject: a stance, an analysis, a run of postures, a log beside criteria, an optimum (before
            and after), or a recording or sweep with the stance it was made of.
        stance: that stance; of the others None.
        criteria: whose centres of pressure are shown; default those of an analysis or an optimum,
            else the paper's two.
        limits: within which; default those of an analysis, else none.
        meshes: show the robot's meshes, which the page then gives on under their licence.
        height: of the frame in a notebook [pixels].
        rate: frames a second of a film.
        advance: called with the number of views that are done.

    Raises:
        InvalidInputError: something else is to be shown, a stance is missing or too many, or a
            policy shares the load.
        MissingExtraError: viser is not installed.
    """
    check_type(subject, Subject.__args__, "what is shown", "Give a stance, an analysis or a run.")
    if (stance is not None) != isinstance(subject, _MADE_OF):
        name = type(subject).__name__
        raise InvalidInputError(
            f"a {name} does not hold the stance it was made of: give it, show({name.lower()}, "
            "stance)."
            if stance is None
            else f"a {name} holds its stance: give no other."
        )
    model = _model(subject, stance, criteria, limits)
    page = page_of(model, model.start, meshes=meshes, rate=rate, command="", advance=advance)
    return ShownPage(page, height)


def paper_criteria_and(criterion: Criterion) -> list[Criterion]:
    """The paper's two criteria, and another one first: the one that was applied, say."""
    usual = [minimum_wrench(1.0), minimum_torque()]
    others = [each for each in usual if each.name != criterion.name]
    return usual if criterion in usual else [criterion, *others]


def _model(
    subject: Subject,
    stance: Stance | None,
    criteria: Sequence[Criterion] | None,
    limits: Limits | None,
) -> Model:
    if isinstance(subject, Analysis):
        own = [found.equilibrium.criterion for found in subject.sensitivities.values()]
        if criteria is None and not all(isinstance(each, Criterion) for each in own):
            raise InvalidInputError(
                "a policy of the analysis cannot be shown in 3-D, which asks it at other postures. "
                "Give criteria=[...]."
            )
        criteria = own if criteria is None else criteria  # type: ignore[assignment]
        limits = subject.limits if limits is None else limits
        subject = subject.stance
    if isinstance(subject, Stance):
        return Model(subject, criteria=criteria, limits=limits)
    if isinstance(subject, PostureRun):
        run = subject
    elif isinstance(subject, LogComparison):
        run = subject.run
    elif isinstance(subject, Optimum):
        both = subject.before, subject.after
        stances = [each.stance for each in both]
        run = PostureRun.of_stances(stances, axis="before (0), after (1)", source="the optimum")
        names = {each.criterion.name: each.criterion for each in both}
        criteria = list(names.values()) if criteria is None else criteria
    else:
        assert stance is not None
        made = recording_run if isinstance(subject, Recording) else sweep_run
        run = made(subject, stance)  # type: ignore[arg-type]
    return PlayedModel(run, criteria=criteria, limits=limits)
