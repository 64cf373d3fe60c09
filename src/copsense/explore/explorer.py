"""Explorer: a model, its panel and its scene in one window, and the thread that serves them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from copsense.batch.machine_code import COMPILING_TAKES
from copsense.blas import one_blas_thread
from copsense.design import Objective
from copsense.errors import CopsenseError
from copsense.explore.best_weights import best_weights
from copsense.explore.drawing import Scene, fit_camera, look_at, place_camera, support
from copsense.explore.model import Model, Stale
from copsense.explore.panel import Panel
from copsense.explore.played_model import PlayedModel
from copsense.explore.server import LOOPBACK, GuardedServer
from copsense.explore.shape import Shape, load_shape
from copsense.explore.state import State
from copsense.explore.view import View
from copsense.explore.worker import Worker

_RATE = 25.0  # frames a second of a playback
_FOLLOW, _ENDS = 0.3, 1.0  # s of rest before sliders follow the posture, and their ends the state


class Explorer:
    """A robot in the browser: open `url`, and `close` when done.

    Also a context manager.

    Attributes:
        model: what answers.
        server: the guarded server.
        seconds: from the beginning to the first view drawn.
    """

    model: Model
    server: GuardedServer
    seconds: float

    def __init__(
        self,
        model: Model,
        state: State | None = None,
        *,
        port: int = 0,
        host: str = LOOPBACK,
        meshes: bool = True,
        light: bool = False,
        dark: bool = False,
    ) -> None:
        """Draw the first view and begin to listen.

        Args:
            model: the stance to explore.
            state: what is asked for to begin with; default the stance itself.
            port: 0 for any that is free.
            host: where to listen.
            meshes: show the robot's meshes; if not, the stick figure.
            light: leave out what machines without a GPU cannot draw.
            dark: a dark page.

        Raises:
            OutputError: nothing can listen there.
            MissingExtraError: viser is not installed.
        """
        begun = time.monotonic()
        self.model, self._status, self._saved, self._problem = model, "", "", ""
        self._lock, self._resources = threading.Lock(), ExitStack()
        state = state or replace(model.start, overlays=frozenset({"curve"}))
        self._shape, problem = _shape_of(model, meshes)
        self._first = model.view(state)
        self.server = GuardedServer(port, host)
        try:
            self._begin(state, problem, light, dark)
        except BaseException:
            self._resources.close()
            self.server.stop()
            raise
        self.seconds = time.monotonic() - begun

    def _begin(self, state: State, problem: list[str], light: bool, dark: bool) -> None:
        """Fill the window, and start the thread."""
        viser, model, first = self.server.viser, self.model, self._first
        viser.gui.configure_theme(
            show_logo=False, show_share_button=False, control_width="large", dark_mode=dark
        )
        viser.gui.set_panel_label(f"copsense explore: {model.stance.robot.name}")
        self._worker = Worker(model, self._publish, stages=self._stages())
        self._panel = Panel(
            viser,
            model,
            state,
            meshes=bool(self._shape.meshes),
            changed=self._changed,
            actions={
                "reset": self._reset,
                "above": self._from_above,
                "front": self._from_front,
                "save stance": self._save,
            },
            weighings={
                "go farthest": lambda: self._weigh("travel"),
                "move least": lambda: self._weigh("gain"),
            },
            run=model.run if isinstance(model, PlayedModel) else None,
        )
        self._scene = Scene(
            viser, first, self._shape, light=light, dark=dark, clicked=self._panel.pin
        )
        self._base_status = "; ".join([*problem, *self._shape.notes[:1]])
        self._compiling: threading.Thread | None = None
        self._weighing = threading.Lock()
        place_camera(viser, first)
        viser.on_client_connect(lambda client: fit_camera(client, self.view))
        self._publish(first)
        self._resources.enter_context(one_blas_thread())
        self._worker.start()
        self._worker.submit(state)
        self._closing = threading.Event()
        if isinstance(model, PlayedModel):
            threading.Thread(target=self._play, daemon=True).start()

    @property
    def url(self) -> str:
        """The address to open, with its token."""
        return self.server.url

    @property
    def view(self) -> View:
        """What is shown now."""
        return self._worker.view or self._first

    def close(self) -> None:
        """Stop working, then listening."""
        self._closing.set()
        self._worker.stop()
        self.server.stop()
        self._resources.close()

    def __enter__(self) -> Explorer:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    def _changed(self) -> None:
        # Callbacks run in many threads: the last to read reads the newest.
        with self._lock:
            try:
                state, self._problem = self._panel.read(), ""
            except CopsenseError as error:  # a number that means nothing
                self._problem = str(error)
                self._worker.again()
                return
            if isinstance(self.model, PlayedModel):
                self.model.row = self._panel.row
            if state.held and not self.model.compiled and self._compiling is None:
                self._compiling = threading.Thread(target=self._compile, daemon=True)
                self._compiling.start()
            self._worker.submit(state)

    def _publish(self, view: View) -> None:
        viser = self.server.viser
        status = "; ".join(
            filter(
                None,
                (self._problem, self._status, self._base_status, self._worker.error[-300:]),
            )
        )
        with viser.atomic():
            self._scene.show(view, self._panel.shown(view))
            self._panel.write(view, status, self._saved)
        viser.flush()

    def _stages(self) -> tuple[tuple[float, Callable[[View, Stale], View]], ...]:
        if isinstance(self.model, PlayedModel):
            return self.model.stages
        own = ((_FOLLOW, self._follow), (_ENDS, self._find_ends))
        return tuple(sorted((*self.model.stages, *own), key=lambda stage: stage[0]))

    def _follow(self, view: View, stale: Stale) -> View:
        """Have the sliders that ask for nothing follow the posture."""
        if not view.reason:
            self._panel.follow(self.model.values(view))
        return view

    def _find_ends(self, view: View, stale: Stale) -> View:
        """Let sliders end where the robot does."""
        kinds = ("com", "trunk") if view.state.held else ("com",)
        for name, coordinate in self.model.coordinates.items():
            if coordinate.kind in kinds and not view.reason:
                low, high = self.model.reach(view.state, name, stale)
                if stale():
                    return view
                self._panel.set_ends(name, low, high)
        return view

    def _play(self) -> None:
        """Go on in time while it is played; a frame that is not ready is left out."""
        before = time.monotonic()
        while not self._closing.wait(1 / _RATE):
            now = time.monotonic()
            if self._worker.idle:
                if self._panel.advance(now - before):
                    self._changed()
                before = now

    def _compile(self) -> None:
        self._status = (
            f"the search for postures is compiled, once on a machine ({COMPILING_TAKES}); until "
            "then one posture at a time"
        )
        self._worker.again()
        try:
            self.model.use_compiled()
            self._status = ""
        except CopsenseError as error:
            self._status = f"the search for postures is not compiled: {error}"
        self._worker.again()

    def _weigh(self, objective: Objective) -> None:
        """Look for the best weights, beside the window, and set the sliders to them."""
        if not self._weighing.acquire(blocking=False):
            return  # one search at a time
        try:
            self._saved = "looking for the best weights ..."
            self._worker.again()
            with self._lock:
                state = self._panel.read()
            keys = self._panel.weight_keys
            weights, self._saved = best_weights(self.model, state, keys, objective)
            self._panel.set_weights(weights)
        except CopsenseError as error:
            self._saved = f"no best weights: {error}"
            self._worker.again()
        finally:
            self._weighing.release()

    def _reset(self) -> None:
        self._saved = ""
        self._panel.hide_robot(False)
        self._panel.reset()

    def _save(self) -> None:
        from copsense.robots import PRESETS, save_stance

        view = self.view
        state = view.state
        name = "".join(c if c.isalnum() or c in "-_" else "-" for c in self.model.stance.robot.name)
        number, path = 1, Path(f"{name}-stance.toml")
        while path.exists():
            number += 1
            path = Path(f"{name}-stance-{number}.toml")
        words, origin = self.model.words, self.model.stance.robot.description
        if words[0] in PRESETS:
            origin = None  # it knows its own
        try:
            save_stance(
                self.model.stance.at(view.q),
                path,
                robot=words[0] if words[0] in PRESETS else None,
                package_dirs=() if origin is None else origin.package_dirs,
                limits=self.model.limits_of(state),
                criteria=tuple(self.model.criteria_of(state).values()),
            )
            self._saved = f"written: {path.absolute()}"
        except CopsenseError as error:
            self._saved = f"not written: {error}"
        self._worker.again()

    def _from_above(self) -> None:
        self._panel.hide_robot(True)  # what counts is under it
        middle, size = support(self.view)
        self._move_cameras(middle, middle + size * np.array([-1e-3, 0.0, 1.0]))

    def _from_front(self) -> None:
        self._panel.hide_robot(False)
        middle, size = look_at(self.view)
        self._move_cameras(middle, middle + size * np.array([1.25, 0.0, 0.1]))

    def _move_cameras(self, at: np.ndarray, where: np.ndarray) -> None:
        for client in self.server.viser.get_clients().values():
            with client.atomic():
                client.camera.up_direction = (0.0, 0.0, 1.0)
                client.camera.position, client.camera.look_at = where, at


def _shape_of(model: Model, meshes: bool) -> tuple[Shape, list[str]]:
    if not meshes:
        return Shape(), []
    try:
        return load_shape(model.stance.robot), []
    except CopsenseError as error:
        return Shape(), [f"stick figure: {error}"]
