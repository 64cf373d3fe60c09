"""A headless Chromium for tests, and what is looked for in its pages."""

import io
import shutil
import time
from contextlib import contextmanager

import pytest
from PIL import Image

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# The default GL of headless Chromium without a GPU, SwiftShader, draws WebGL with these.
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-extensions"]
_SHADED = 60  # of 255: how far light and shadow take a colour
_PLACE = """([x, y, z]) => {
  const seen = window.__viserMutable, root = seen.nodeRefFromName[''];
  const place = root.position.clone().set(x, y, z).applyMatrix4(root.matrixWorld);
  place.project(seen.camera);
  const box = document.querySelector('canvas').getBoundingClientRect();
  return [box.x + (place.x + 1) / 2 * box.width, box.y + (1 - place.y) / 2 * box.height];
}"""


@contextmanager
def chromium():
    """A browser; the test is skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    executable = next(filter(None, map(shutil.which, BROWSERS)), None)
    if executable is None:
        pytest.skip(f"no browser found; looked for {', '.join(BROWSERS)}")
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=executable, args=ARGUMENTS)
        yield browser
        browser.close()


@contextmanager
def offline(browser, path, width=1000, height=700, scheme="light"):
    """A file's page without a network; its requests and errors are kept on it."""
    context = browser.new_context(
        offline=True, viewport={"width": width, "height": height}, color_scheme=scheme
    )
    page = context.new_page()
    page.requested, page.failed = [], []
    page.on("request", lambda request: page.requested.append(request.url))
    page.on("pageerror", lambda error: page.failed.append(str(error)))
    page.goto(path.as_uri())
    yield page
    context.close()


def scene_of(page, number=1):
    """The frame of a 3-D view in a page, when everything is in its scene."""
    frame = page.frames[number]
    frame.wait_for_function(
        "window.__viserMutable && window.__viserMutable.scene"
        " && window.__viserMutable.messageQueue.length === 0",
        timeout=60_000,
    )
    return frame


def colour_at(scene, point, colour, wait=20.0, reach=3):
    """The colour nearest to one around where a point of the world is seen, and if it is that one.

    In the frame of a 3-D view, or in a page that is one. Waits until it is near, or for so many
    seconds: the first frames may be empty.
    """
    end = time.monotonic() + wait
    while True:
        x, y = scene.evaluate(_PLACE, [float(value) for value in point])
        framed = getattr(scene, "frame_element", None)  # a page is not in a frame
        picture = scene.screenshot() if framed is None else framed().screenshot()
        image = Image.open(io.BytesIO(picture)).convert("RGB")
        seen = [
            image.getpixel((round(x) + i, round(y) + j))
            for i in range(-reach, reach + 1)
            for j in range(-reach, reach + 1)
        ]
        nearest = min(seen, key=lambda s: max(abs(a - b) for a, b in zip(s, colour, strict=True)))
        off = max(abs(a - b) for a, b in zip(nearest, colour, strict=True))
        if off < _SHADED or time.monotonic() > end:
            return nearest, off < _SHADED
