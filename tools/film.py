"""Make the film of the README: an iCub leans in MuJoCo until a foot tips, under two criteria.

Run: .venv/bin/python tools/film.py   (a minute or two; writes docs/images/film.webp)
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from PIL import Image

import copsense
from copsense.controllers import Ramp
from copsense.simulation import Recording, Scenario
from copsense.skeleton import skeleton

OUTPUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "film.webp"
LENGTH, RATE, HOLD = 30.0, 12, 4.0  # seconds, frames a second, seconds of the last picture
COLOUR = {"minimum-wrench": "#d55e00", "minimum-torque": "#0072b2"}  # as in every figure
INK, MUTED, SOLE, ALARM = "#1f2a36", "#8a949e", "#e4e9ee", "#c1121f"
EYE, MIDDLE = np.array([-1.9, 0.55, 1.15]), np.array([0.0, 0.0, 0.40])  # from behind [m]
ZOOM = 1.9
SEEN = (-0.36, 0.36, -0.40, 0.50)  # of the picture, at the robot's distance


def project(points: np.ndarray) -> np.ndarray:
    """World points (..., 3) as seen from EYE: to the right, up, and how far away."""
    ahead = (MIDDLE - EYE) / np.linalg.norm(MIDDLE - EYE)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    seen = (points - EYE) @ np.column_stack([right, up, ahead])
    return np.concatenate([ZOOM * seen[..., :2] / seen[..., 2:], seen[..., 2:]], axis=-1)


def frame_place(stance: copsense.Stance, name: str) -> np.ndarray:
    """Where a frame of the robot is (3,) [m]."""
    model = stance.robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array(stance.q))
    return data.oMf[stance.robot.frame_id(name)].translation


class Side:
    """One robot: what MuJoCo recorded of it, and how it is drawn."""

    def __init__(self, stance: copsense.Stance, recording: Recording, name: str) -> None:
        """Read what every frame needs."""
        self.stance, self.name, self.colour = stance, name, COLOUR[name]
        self.time = recording["time"].values
        self.configurations = recording["configuration"].values
        self.cops, self.coms = recording["cop"].values, recording["com"].values
        self.margins = recording["margin"].values
        self.loads = recording["wrench"].sel(component="fz").values / stance.robot.weight
        tip = recording.tip
        assert tip is not None
        self.tip_time, self.tip_travel = tip.time, recording.tip_travel
        self.tipped = stance.contact_names.index(tip.contact)

    def row(self, time: float) -> int:
        """The sample at a time; after its end the last."""
        return int(min(np.searchsorted(self.time, time), len(self.time) - 1))

    def draw_robot(self, ax: Axes, row: int) -> None:
        """Draw it from behind on its soles, with the weight's line and the contacts' forces."""
        ax.clear()
        ax.set_axis_off()
        ax.set_aspect("equal")
        ax.set(xlim=SEEN[:2], ylim=SEEN[2:])
        here = self.stance.at(self.configurations[row], check=False)
        over = self.time[row] >= self.tip_time
        for k, (contact, place) in enumerate(zip(here.contacts, here.placements, strict=True)):
            flat = np.column_stack([contact.polygon, np.zeros(len(contact.polygon))])
            outline = project(place.translation + flat @ place.rotation.T)[:, :2]
            edge = ALARM if over and k == self.tipped else MUTED
            ax.add_patch(Polygon(outline, facecolor=SOLE, edgecolor=edge, linewidth=1.5))
        bones = project(skeleton(here))
        for bone in bones[np.argsort(-bones[:, :, 2].mean(axis=1))]:
            for width, shade in ((9.0, INK), (6.5, "#c3ccd5")):
                ax.plot(*bone[:, :2].T, color=shade, linewidth=width, solid_capstyle="round")
        com = self.coms[row]
        if "head" in self.stance.robot.frame_names:
            head = project(frame_place(here, "head"))
            ax.plot(*head[:2], "o", color="#c3ccd5", markeredgecolor=INK, markersize=17, mew=1.4)
        line = project(np.array([com, [com[0], com[1], 0.0]]))
        ax.plot(*line[:, :2].T, color=INK, linewidth=1.2, linestyle=(0, (3, 2)))
        ax.plot(*line[0, :2], "o", color="white", markeredgecolor=INK, markersize=9)
        for k, place in enumerate(here.placements):
            cop = place.translation + place.rotation @ [*self.cops[row, k], 0.0]
            force = np.array([0.0, 0.0, 0.3 * min(self.loads[row, k], 1.0)])
            arrow = project(np.array([cop, cop + force]))
            ax.plot(*arrow[:, :2].T, color=self.colour, linewidth=3.0, solid_capstyle="round")
            ax.plot(*arrow[0, :2], "o", color=self.colour, markersize=7)
        ax.set_title(self.name.replace("-", " "), color=self.colour, fontsize=14, weight="bold")

    def draw_soles(self, ax: Axes, row: int) -> None:
        """Draw the soles from above, with the way of each CoP."""
        ax.clear()
        ax.set_axis_off()
        ax.set_aspect("equal")
        over = self.time[row] >= self.tip_time
        last = min(row, self.row(self.tip_time))
        for k, (contact, place) in enumerate(
            zip(self.stance.contacts, self.stance.placements, strict=True)
        ):
            alarm = over and k == self.tipped
            corners = (place.translation[:2] + contact.polygon @ place.rotation[:2, :2].T)[:, ::-1]
            edge = ALARM if alarm else MUTED
            width = 2.5 if alarm else 1.2
            ax.add_patch(Polygon(corners, facecolor=SOLE, edgecolor=edge, linewidth=width))
            way = place.translation[:2] + self.cops[: last + 1, k] @ place.rotation[:2, :2].T
            ax.plot(way[:, 1], way[:, 0], color=self.colour, linewidth=2.0)
            ax.plot(way[-1, 1], way[-1, 0], "o", color=self.colour, markersize=9)
            share = f"{self.loads[last, k]:.0%}"
            ax.text(place.translation[1], -0.085, share, ha="center", va="top", color=INK)
        ax.plot(self.coms[row, 1], self.coms[row, 0], "+", color=INK, markersize=11, mew=2)
        ax.set(xlim=(0.16, -0.16), ylim=(-0.115, 0.14))
        words, shade = f"{self.margins[last].min() * 1e3:.0f} mm to the nearest edge", INK
        if over:
            words = f"the right foot tips at {self.tip_travel * 1e3:.0f} mm"
            shade = ALARM
        ax.set_title(words, color=shade, fontsize=11, weight="bold" if over else "normal")


def draw_lean(
    ax: Axes, asked: float, sides: list[Side], predicted: dict[str, float], slow: float
) -> None:
    """Draw how far the centre of mass has leant, and where statics say that a foot tips."""
    ax.clear()
    ax.set(xlim=(-2, 59), ylim=(-1.2, 1.3))
    ax.set_axis_off()
    ax.plot([0, 52], [0, 0], color=SOLE, linewidth=7, solid_capstyle="round")
    ax.plot([0, asked * 1e3], [0, 0], color=INK, linewidth=7, solid_capstyle="round")
    for side in sides:
        at = predicted[side.name] * 1e3
        ax.plot([at, at], [-0.45, 0.45], color=side.colour, linewidth=2.5)
        words, ha = f"statics: {at:.1f} mm", "left" if side is sides[-1] else "right"
        ax.text(at, 0.62, words, color=side.colour, ha=ha, fontsize=9)
    words = f"the centre of mass leans to the left: {asked * 1e3:.0f} mm"
    ax.text(0, -0.5, words, color=INK, va="top", fontsize=10)
    ax.text(
        52, -0.5, f"MuJoCo, {slow:.0f} times slowed", color=MUTED, va="top", ha="right", fontsize=8
    )


def frames(sides: list[Side], predicted: dict[str, float]) -> list[Image.Image]:
    """The pictures of the film, the last of them held."""
    end = max(side.time[-1] for side in sides)
    figure = Figure(figsize=(6.6, 6.0), facecolor="white")
    grid = figure.add_gridspec(
        3,
        2,
        height_ratios=(3.7, 2.0, 0.72),
        left=0.02,
        right=0.98,
        top=0.94,
        bottom=0.0,
        hspace=0.16,
    )
    robots = [figure.add_subplot(grid[0, k]) for k in range(2)]
    soles = [figure.add_subplot(grid[1, k]) for k in range(2)]
    bar = figure.add_subplot(grid[2, :])
    canvas = FigureCanvasAgg(figure)
    moving = int((LENGTH - HOLD) * RATE)
    pictures = []
    for number, time in enumerate(np.linspace(0.05, end, moving)):
        for side, robot, sole in zip(sides, robots, soles, strict=True):
            row = side.row(time)
            side.draw_robot(robot, row)
            side.draw_soles(sole, row)
        longest = max(sides, key=lambda side: side.time[-1])
        asked = float(longest.coms[longest.row(time), 1] - longest.coms[0, 1])
        draw_lean(bar, asked, sides, predicted, (LENGTH - HOLD) / end)
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3]))
        if not number % 30:
            print(f"\r{number} of {moving} pictures", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return pictures


def main() -> None:
    """Simulate, draw, and write the film."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    stance = copsense.load_stance("icub")
    lean = Scenario(7.0, Ramp(0.055, speed=0.012), control_period=2e-3)
    path = copsense.lateral_sweep(stance, -0.055, 0.055, 23)
    sides, predicted = [], {}
    for criterion in (copsense.minimum_wrench(1.0), copsense.minimum_torque()):
        recording = copsense.balance(stance, criterion, lean)
        sides.append(Side(stance, recording, criterion.name))
        first = copsense.PathScan(path, criterion).travel(copsense.Limits()).first
        predicted[criterion.name] = first.exact
        print(
            f"{criterion.name}: statics {first.exact * 1e3:.1f} mm, tips at "
            f"{recording.tip_travel * 1e3:.1f} mm"
        )
    pictures = frames(sides, predicted)
    durations = [round(1000 / RATE)] * (len(pictures) - 1) + [round(1000 * HOLD)]
    pictures[0].save(
        OUTPUT,
        save_all=True,
        append_images=pictures[1:],
        duration=durations,
        loop=0,
        quality=60,
        method=4,
    )
    print(f"written: {OUTPUT.name}, {OUTPUT.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
