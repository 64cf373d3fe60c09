"""Make the small pictures of the documentation: what the commands of its pages draw.

Tutorials are followed as a reader would follow them, and what they drew is kept; of other pages the
one command that draws is run. Pictures become WebP, small enough to be committed.

Run: .venv/bin/python tools/pictures.py [NAME ...]   (all of them: some minutes)
"""

from __future__ import annotations

import io
import os
import shlex
import sys
import tempfile
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.commands import copsense
from support.sessions import Reader, steps

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
WIDTHS, LARGEST = (1400, 1200, 1000), 60_000  # pixels, bytes
# Picture -> tutorial, and the file that it draws.
TUTORIALS = {
    "alexander": ("my_robot", "alexander.png"),
    "regions": ("limits", "regions.png"),
    "before_after": ("which_posture", "before_after.png"),
    "thousand_postures": ("million_postures", "icub_map.png"),
    "pushed": ("my_controller", "pushed.png"),
    "my_log": ("my_log", "my_log.png"),
}
# Picture -> page, and the command on it that draws the file.
GUIDES = {
    "map": (
        "maps",
        "copsense map icub --over com_y=-50mm:50mm:41 --over com_z=485mm:510mm:26 "
        "--output icub.zarr --plot map.png",
    ),
    "tip": (
        "balancing",
        "copsense balance icub --criterion minimum-torque --reference ramp:60mm --until tip "
        "--plot tip.png",
    ),
    "leans": (
        "benchmark",
        "copsense benchmark icub --quick --disturbance lean --output leans.csv --plot leans.png",
    ),
    "stair": (
        "postures",
        "copsense analyse talos --ground left_sole_link=0:0:100mm --contact-at sole "
        "--plot stair.png",
    ),
    "push": ("drives", "copsense push icub --at root_link --plot push.png"),
    "in_motion": (
        "motion",
        "copsense balance icub --criterion minimum-torque --reference sine:0.03:0.2 "
        "--duration 10s --plot in_motion.png",
    ),
}


def run(*arguments: str) -> tuple[int, str]:
    """A command of copsense, in this process."""
    answer = copsense(*arguments, together=True)
    return answer.code, answer.out


def follow(page: str, drawn: str) -> Image.Image:
    """What a tutorial draws, once it has been followed so far."""
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        sys.path.insert(0, name)
        reader = Reader(Path(name), run)
        for step in steps(ROOT / "docs" / "tutorials" / f"{page}.md"):
            reader.follow(step)
            if Path(name, drawn).is_file():
                break
        return Image.open(Path(name, drawn)).convert("RGB")


def draw(page: str, command: str) -> Image.Image:
    """What a command draws that stands on a page."""
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    if command not in " ".join(text.replace("\\\n", " ").split()):
        raise SystemExit(f"docs/{page}.md has no line {command!r} any more")
    arguments = shlex.split(command)[1:]
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        _, said = run(*arguments)
        drawn = Path(name, arguments[arguments.index("--plot") + 1])
        if not drawn.is_file():  # a robot that tips ends with a code of its own
            raise SystemExit(f"{command}\n{said}")
        return Image.open(drawn).convert("RGB")


def last_frame() -> Image.Image:
    """The end of the README's film."""
    film = Image.open(IMAGES / "film.webp")
    film.seek(film.n_frames - 1)
    return film.convert("RGB")


def sole_sketch() -> Image.Image:
    """A sole from above, for the theory: its CoP, an edge, the margin, and where the CoP goes."""
    ink, muted, sole, way = "#1d2733", "#5b6672", "#e8ecf0", "#0072B2"
    figure = Figure(figsize=(8.4, 3.3), dpi=150, layout="constrained")
    above, load = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    corners = np.array([[-66, -43], [129, -43], [129, 51], [-66, 51]])
    above.fill(corners[:, 0], corners[:, 1], facecolor=sole, edgecolor=muted, linewidth=1.2)
    above.plot([-66, 129], [51, 51], color=ink, linewidth=2.6)
    above.text(118, 56, "edge $e$:  $a_e \\cdot p = b_e$", ha="right", color=ink)
    cop, moved = np.array([25.0, 10.0]), np.array([39.0, 31.0])
    line = {"arrowstyle": "<->", "color": muted, "shrinkA": 0, "shrinkB": 0}
    above.annotate("", (cop[0], 51), cop, arrowprops=line)
    above.text(21, 30, "margin $\\mu_e$", ha="right", color=muted)
    goes = {"arrowstyle": "-|>", "color": way, "linewidth": 2.2, "shrinkA": 0, "shrinkB": 0}
    above.annotate("", moved, cop, arrowprops=goes)
    follows = "$\\Gamma_k\\,\\mathrm{d}c$: with the\ncentre of mass"
    above.text(42, 20, follows, va="center", color=way)
    out = {"arrowstyle": "-|>", "color": ink, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
    above.annotate("", (-40, 75), (-40, 51), arrowprops=out)
    above.text(-36, 67, "$a_e$", color=ink)
    above.plot(*cop, "o", color=way, markersize=9, zorder=5)
    above.text(cop[0], cop[1] - 7, "centre of pressure $p_k$", ha="center", va="top", color=ink)
    above.set(aspect="equal", xlim=(-75, 138), ylim=(-52, 82))
    above.set_axis_off()
    above.set_title("a sole, from above", loc="left", fontsize=10.5, fontweight="bold", color=ink)

    travel = np.linspace(0.0, 1.35, 100)
    share, inside = 0.5 - 0.17 * travel, 1.0 - 0.62 * travel - 0.12 * travel**2
    slack = share * inside / 0.5
    rate = (slack[1] - slack[0]) / (travel[1] - travel[0])
    load.plot(travel, slack, color=way, linewidth=2.2, label="slack $w_k\\,\\mu_e$")
    load.plot(travel, 1 + rate * travel, "--", color=muted, label="to first order")
    load.axhline(0.0, color=ink, linewidth=0.9)
    load.plot(-1 / rate, 0.0, "o", color=muted, zorder=5)
    load.text(-1 / rate, -0.07, "$\\delta_k$", ha="center", va="top", color=ink, fontsize=12)
    load.set(xlabel="travel of the centre of mass", xticks=[], yticks=[], ylim=(-0.3, 1.1))
    load.spines[["top", "right"]].set_visible(False)
    load.legend(frameon=False)
    load.set_title(
        "load times margin: zero is a tip", loc="left", fontsize=10.5, fontweight="bold", color=ink
    )
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def explorer() -> Image.Image:
    """The explorer's window, the iCub leaning; it needs Chromium and playwright."""
    from support.browser import chromium

    from copsense import load_stance
    from copsense.explore import Model, Setting, State
    from copsense.explore.explorer import Explorer

    state = State(("icub",), coordinates={"com_y": Setting(0.03, "m")})
    with (
        Explorer(Model(load_stance("icub")), state, meshes=False, light=True) as window,
        chromium() as browser,
    ):
        page = browser.new_page(viewport={"width": 1280, "height": 860})
        page.goto(window.url)
        page.wait_for_function(
            "window.__viserMutable && window.__viserMutable.messageQueue.length === 0"
        )
        page.wait_for_timeout(6000)
        for note in page.locator(".mantine-Notification-closeButton").all():
            note.click()  # that this browser has no graphics processor
        page.wait_for_timeout(2000)
        return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def keep(name: str, picture: Image.Image) -> None:
    """Write a picture, no larger than it may be."""
    path = IMAGES / f"{name}.webp"
    for width, quality in product(WIDTHS, (90, 80, 70, 60, 50, 40)):
        wide = min(width, picture.width)
        size = (wide, round(picture.height * wide / picture.width))
        picture.resize(size, Image.Resampling.LANCZOS).save(path, quality=quality, method=6)
        if path.stat().st_size < LARGEST:
            break
    else:
        raise SystemExit(f"{path} has {path.stat().st_size} bytes")
    print(f"{path.name}: {size}, {path.stat().st_size} bytes", flush=True)


def main(names: list[str]) -> None:
    """Make the pictures of these names, or all."""
    makers = {"film_end": last_frame, "slack": sole_sketch, "explorer": explorer}
    for name in names or [*makers, *GUIDES, *TUTORIALS]:
        if name in makers:
            keep(name, makers[name]())
        elif name in GUIDES:
            keep(name, draw(*GUIDES[name]))
        else:
            keep(name, follow(*TUTORIALS[name]))


if __name__ == "__main__":
    main(sys.argv[1:])
