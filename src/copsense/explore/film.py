"""Film: views as a scene of viser's own client, in one page that plays without a server."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from pathlib import Path

from copsense.explore.drawing import OPACITY, Scene, Shown, place_camera
from copsense.explore.server import GuardedServer
from copsense.explore.shape import Shape
from copsense.explore.view import View

_NEAR = 0.8  # of the distance of a window's camera: a page's picture is smaller
# Without a GPU viser's client says so over the picture, though the picture is all there is.
_QUIET = "<style>.mantine-Notification-root{display:none!important}</style>"
_DARK = (
    '<script>const dark=matchMedia("(prefers-color-scheme: dark)");if(dark.matches){{'
    'window.__VISER_EMBED_DATA__="{}";window.__VISER_EMBED_CONFIG__={{darkMode:true}};}}'
    'dark.addEventListener("change",()=>location.reload());</script>'
)


def film_html(
    views: Sequence[View],
    seconds: float = 0.0,
    shape: Shape | None = None,
    advance: Callable[[int], object] = lambda _: None,
) -> str:
    """Views as a page of their own: a picture of one, of several a film with a bar to play it.

    It is drawn for light and for dark pages, and shows itself as the browser asks for; with meshes,
    which would be in it twice, for light ones alone.

    Args:
        views: of one model, at least one.
        seconds: between them.
        shape: the robot's meshes; default the stick figure.
        advance: called with the number of views that are drawn, each once.

    Returns:
        HTML that needs no other file and no network.

    Raises:
        MissingExtraError: viser is not installed.
    """
    shape = shape or Shape()
    light = _recorded(views, seconds, shape, False, advance)
    page, more = str(light.as_html()), _QUIET
    if not shape.meshes:
        dark = _recorded(views, seconds, shape, True, lambda _: None)
        more += _DARK.format(base64.b64encode(dark.serialize()).decode("ascii"))
    end = page.index("</head>")
    return page[:end] + more + page[end:]


def coloured_by(view: View) -> str:
    """The criterion whose torques colour the joints of a film; empty where there is none."""
    return view.criteria[-1].name if view.criteria else ""


def client_notices() -> str:
    """Who wrote what viser's client holds: a page gives it on, and it says nothing of that."""
    return Path(__file__).with_name("notices.txt").read_text(encoding="utf-8")


def _recorded(  # type: ignore[no-untyped-def]  # viser's serializer
    views: Sequence[View],
    seconds: float,
    shape: Shape,
    dark: bool,
    advance: Callable[[int], object],
):
    server = GuardedServer()
    try:
        scene = Scene(server.viser, views[0], shape, light=True, dark=dark)
        shown = Shown(torques=coloured_by(views[0]), opacity=OPACITY)
        scene.show(views[0], shown)
        place_camera(server.viser, views[0], _NEAR, shape)
        recording = server.viser.get_scene_serializer()
        for view in views if len(views) > 1 else ():
            scene.show(view, shown)
            recording.insert_sleep(seconds)
            advance(1)
        return recording
    finally:
        server.stop()
