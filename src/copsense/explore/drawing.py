"""Drawing: a view as things in a scene. It only assigns; nothing is computed on the robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from copsense.explore.shape import Shape
from copsense.explore.view import CriterionView, View, placed

Colour = tuple[int, int, int]

BONE: Colour = (150, 160, 172)
LOADED: Colour = (200, 60, 120)


class Inks(NamedTuple):
    """What lines are drawn with, so that they are seen on the page."""

    line: Colour
    sole: Colour
    ground: Colour
    measured: Colour


ON_LIGHT = Inks((29, 39, 51), (70, 84, 99), (205, 212, 219), (120, 30, 160))
ON_DARK = Inks((226, 231, 237), (160, 174, 190), (74, 82, 92), (215, 130, 250))
# As in the figures: the paper's two criteria, then others in order.
NAMED: Mapping[str, Colour] = {"minimum-wrench": (213, 94, 0), "minimum-torque": (0, 114, 178)}
OTHERS: tuple[Colour, ...] = ((0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233))
SHADES = 24  # steps of the torque colours: else each tick sends every joint's
_COLD, _MILD, _HOT = np.array([(196, 204, 212), (240, 200, 80), (200, 30, 30)], dtype=float)
OPACITY = 0.6  # of meshes at first: what counts is inside the feet
# Hundredths of the robot's height: what was measured is behind what should be there.
_FORMS: Mapping[str, tuple[float, float]] = {"square": (1.5, 3.0), "diamond": (3.0, 2.0)}
# Which labels are shown: a contact's with its load, a joint's with its torque.
NO_LABELS, CONTACTS, LARGEST, JOINTS = "none", "contacts", "largest torques", "all torques"
LABELS = (NO_LABELS, CONTACTS, LARGEST, JOINTS)
_LARGEST = 6  # torques
_NARROW = 700  # pixels
_LIFT = 0.002  # m: outlines over the ground, so that they do not flicker


@dataclass(frozen=True)
class Shown:
    """What of a view is drawn.

    Attributes:
        robot: its meshes where it has some, the stick figure, or neither.
        forces: arrows of the contact forces, beside a robot that is not hidden.
        torques: joints coloured by torque, of the criterion named; empty for none.
        regions: outlines of the regions of the CoM.
        axes: axes of the contact frames.
        opacity: of the meshes.
        criterion: whose numbers the labels have.
        labels: which of them, one of `LABELS`.
        pinned: joints whose labels are shown whatever `labels` says.
    """

    robot: Literal["meshes", "stick figure", "hidden"] = "meshes"
    forces: bool = True
    torques: str = ""
    regions: bool = True
    axes: bool = False
    opacity: float = 1.0
    criterion: str = ""
    labels: str = NO_LABELS
    pinned: frozenset[str] = frozenset()


def criterion_colours(names: Sequence[str]) -> dict[str, Colour]:
    """A colour for each criterion."""
    rest = iter(OTHERS * (len(names) // len(OTHERS) + 1))
    return {name: NAMED.get(name) or next(rest) for name in names}


def look_at(view: View, shape: Shape | None = None) -> tuple[np.ndarray, float]:
    """The middle of a robot, with its meshes where they are given, and how large it is [m]."""
    points = np.vstack([view.bones.reshape(-1, 3), view.placements[:, :3]])
    for mesh in () if shape is None else shape.meshes:
        ends = zip(mesh.vertices.min(axis=0), mesh.vertices.max(axis=0), strict=True)
        corners = np.array(np.meshgrid(*ends)).reshape(3, -1).T
        points = np.vstack([points, placed(view.poses[mesh.joint], corners)])
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, max(float(np.linalg.norm(high - low)), 0.2)


def support(view: View) -> tuple[np.ndarray, float]:
    """The middle of what is on the ground, soles and regions, and how large that is [m]."""
    flat = [view.com[:2], *view.placements[:, :2], *(s[:, :2] for s in view.soles)]
    flat += [region.corners for region in view.regions or ()]
    points = np.vstack([np.reshape(each, (-1, 2)) for each in flat])
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(float(np.linalg.norm(high - low)), 0.1)
    return np.array([*(low + high) / 2, view.ground]), size


def place_camera(
    server: Any, view: View, distance: float = 1.0, shape: Shape | None = None
) -> None:
    """Have the robot in the picture when a browser connects; nearer with less distance."""
    middle, size = look_at(view, shape)
    server.initial_camera.look_at = middle
    server.initial_camera.position = middle + distance * size * np.array([1.05, -0.7, 0.3])


def fit_camera(client: Any, view: View) -> None:
    """Have the robot over the panel, which is at the bottom of a narrow browser, on a phone say."""
    if client.camera.image_width >= _NARROW:
        return
    middle, size = look_at(view)
    away = 2.9 * size
    with client.atomic():
        client.camera.position = middle + away * np.array([0.8, -0.54, 0.27])
        client.camera.look_at = middle - np.array([0.0, 0.0, 0.5 * away])


def effort_colour(share: float) -> Colour:
    """Colour of a torque as a share of its limit, in steps; grey where there is none."""
    if not np.isfinite(share):
        return BONE
    step = round(min(max(share, 0.0), 1.0) * (SHADES - 1)) / (SHADES - 1)
    low, high, part = (_COLD, _MILD, 2 * step) if step < 0.5 else (_MILD, _HOT, 2 * step - 1)
    r, g, b = (int(value) for value in np.round(low + part * (high - low)))
    return r, g, b


class Scene:
    """The things that show a robot, and their places and colours by `show`.

    Attributes:
        height: of the robot [m].
    """

    height: float

    def __init__(
        self,
        server: Any,
        view: View,
        shape: Shape,
        *,
        light: bool = False,
        dark: bool = False,
        clicked: Callable[[str], object] | None = None,
    ) -> None:
        """Put them there.

        Args:
            server: a viser server.
            view: the first one; it says how many things of each kind there are.
            shape: the robot's meshes.
            light: leave out what slow machines cannot draw.
            dark: for a dark page.
            clicked: called with the joint of a link that was clicked.
        """
        self._inks = ON_DARK if dark else ON_LIGHT
        self._scene, self._shape, self._clicked = server.scene, shape, clicked
        self.height = max(float(np.ptp(view.bones[..., 2])), 0.2)
        self._unit = self.height / 100.0
        self._light(light)
        self._ground(view)
        self._robot(view)
        n, u = len(view.contacts), self._unit
        self._soles = self._lines("/soles", 3.0, self._inks.sole)
        self._axes = [
            self._scene.add_frame(f"/contacts/{k}", axes_length=8 * u, axes_radius=0.4 * u)
            for k in range(n)
        ]
        self._com = self._ball("/com", 1.6 * u, self._inks.line)
        self._plumb = self._lines("/plumb", 1.5, self._inks.line)
        self._shadow = self._ball("/com on the ground", 0.9 * u, self._inks.line)
        self._balls: dict[str, list[Any]] = {}
        self._arrows: dict[str, Any] = {}
        self._outlines: dict[str, Any] = {}
        self._clouds: dict[str, Any] = {}
        self._labels: dict[str, Any] = {}
        self._loads: Any = None

    def show(self, view: View, shown: Shown) -> None:
        """Draw a view; call it within ``server.atomic()``."""
        self._show_robot(view, shown)
        self._soles.points = _closed([np.asarray(sole) for sole in view.soles], _LIFT)
        for handle, place in zip(self._axes, view.placements, strict=True):
            handle.position, handle.wxyz = place[:3], place[3:]
            handle.visible = shown.axes
        ground = np.array([*view.com[:2], view.ground + _LIFT])
        self._com.position, self._shadow.position = view.com, ground
        for handle in (self._com, self._plumb):
            _assign(handle, visible=shown.robot != "hidden")
        self._plumb.points = np.array([[view.com, ground]])
        colours = criterion_colours([each.name for each in view.criteria])
        self._show_criteria(view, shown, colours)
        self._show_regions(view, shown, colours)
        self._show_motion(view, colours)
        self._show_loads(view)
        self._show_labels(view, shown)

    def _show_motion(self, view: View, colours: Mapping[str, Colour]) -> None:
        """Centres of pressure in motion as squares, and measured ones as diamonds."""
        shown = {
            f"/in motion/{each.name}": (each.moving_cop_world, colours[each.name], "square")
            for each in view.criteria
            if each.moving_cop_world is not None
        }
        if view.measured is not None:
            shown["/measured"] = (view.measured, self._inks.measured, "diamond")
        for name in self._clouds.keys() - shown:
            _assign(self._clouds[name], visible=False)
        for name, (places, colour, form) in shown.items():
            size, lift = _FORMS[form]
            points = places[np.isfinite(places).all(axis=1)] + np.array([0.0, 0.0, lift * _LIFT])
            if name not in self._clouds:
                self._clouds[name] = self._scene.add_point_cloud(
                    name, points, colour, point_size=size * self._unit, point_shape=form
                )
            _assign(self._clouds[name], visible=bool(len(points)))
            if len(points):
                self._clouds[name].points = points.astype(np.float32)

    def _light(self, light: bool) -> None:
        self._scene.set_up_direction("+z")
        if light:  # the first lit mesh costs a machine without a GPU half a minute otherwise
            self._scene.configure_environment_map(None)
        self._scene.configure_default_lights(True, cast_shadow=False)
        if light:
            self._scene.add_light_hemisphere("/sky", ground_color=(170, 170, 170), intensity=1.5)

    def _ground(self, view: View) -> None:
        step, reach = 0.1, max(8, round(1.2 * self.height / 0.1))
        middle = np.round(view.placements[:, :2].mean(axis=0), 1)
        ticks = step * np.arange(-reach, reach + 1)
        ends = np.array([ticks[0], ticks[-1]])
        across = [[[x, y, 0] for y in ends] for x in ticks]
        along = [[[x, y, 0] for x in ends] for y in ticks]
        handle = self._lines("/ground", 1.0, self._inks.ground)
        handle.points = np.array(across + along) + np.array([*middle, view.ground - _LIFT])

    def _robot(self, view: View) -> None:
        self._frames, self._meshes = {}, {}
        for mesh in self._shape.meshes:
            name = f"/robot/{mesh.joint}"
            self._frames[mesh.joint] = self._scene.add_frame(name, show_axes=False)
            self._meshes[mesh.joint] = self._scene.add_mesh_simple(
                f"{name}/mesh",
                np.asarray(mesh.vertices, np.float32),
                np.asarray(mesh.faces, np.uint32),
                color=BONE,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            if self._clicked is not None:
                self._meshes[mesh.joint].on_click(
                    lambda _, joint=view.joints[mesh.joint], clicked=self._clicked: clicked(joint)
                )
        self._bones = self._scene.add_line_segments(
            "/bones",
            np.asarray(view.bones, np.float32),
            BONE,
            thickness=1.6 * self._unit,
            thickness_units="world",
        )
        self._joints = self._scene.add_point_cloud(
            "/joints",
            np.asarray(view.poses[2:, :3], np.float32),
            np.tile(np.array(BONE, np.uint8), (max(len(view.poses) - 2, 0), 1)),
            point_size=2.4 * self._unit,
            point_shape="circle",
        )

    def _show_robot(self, view: View, shown: Shown) -> None:
        drawn = shown.robot == "meshes" and bool(self._meshes)
        sticks = not drawn and shown.robot != "hidden"
        efforts = _efforts(view, shown.torques)
        colours = [effort_colour(efforts.get(name, np.nan)) for name in view.joints]
        for joint, handle in self._frames.items():
            handle.position, handle.wxyz = view.poses[joint, :3], view.poses[joint, 3:]
            mesh = self._meshes[joint]
            _assign(mesh, visible=drawn, color=colours[joint])
            _assign(mesh, opacity=None if shown.opacity >= 1.0 else shown.opacity)
        _assign(self._bones, visible=sticks)
        _assign(self._joints, visible=sticks)
        if sticks:
            self._bones.points = np.asarray(view.bones, np.float32)
            self._joints.points = np.asarray(view.poses[2:, :3], np.float32)
            self._joints.colors = np.array(colours[2:], np.uint8).reshape(-1, 3)

    def _show_criteria(self, view: View, shown: Shown, colours: Mapping[str, Colour]) -> None:
        weight = max(sum(float(each[2]) for each in _forces(view)), 1e-9)
        for name, colour in colours.items():
            if name not in self._balls:
                self._balls[name] = [
                    self._ball(f"/cop/{len(self._balls)}/{k}", 1.1 * self._unit, colour)
                    for k in range(len(view.contacts))
                ]
                self._arrows[name] = self._scene.add_arrows(
                    f"/force/{len(self._arrows)}",
                    np.zeros((len(view.contacts), 2, 3), np.float32),
                    _for_arrows(colour),
                    shaft_radius=0.5 * self._unit,
                    head_radius=1.2 * self._unit,
                    head_length=2.5 * self._unit,
                )
        for name, balls in self._balls.items():
            there = name in colours
            for ball in balls:
                _assign(ball, visible=there)
            seen = shown.forces and shown.robot != "hidden"  # from above they hide the dots
            _assign(self._arrows[name], visible=there and seen)
        for each in view.criteria:
            for ball, cop in zip(self._balls[each.name], each.cop_world, strict=True):
                ball.visible = bool(np.all(np.isfinite(cop)))
                if ball.visible:
                    ball.position = cop + np.array([0.0, 0.0, _LIFT])
            if shown.forces:
                tips = each.cop_world + each.forces * (0.6 * self.height / weight)
                ends = np.stack([each.cop_world, tips], axis=1)
                self._arrows[each.name].points = np.nan_to_num(ends).astype(np.float32)

    def _show_regions(self, view: View, shown: Shown, colours: Mapping[str, Colour]) -> None:
        found = {each.name: each.corners for each in view.regions or ()}
        for name, corners in found.items():
            if name not in self._outlines:
                colour = colours.get(name, self._inks.line)
                self._outlines[name] = self._lines(f"/region/{len(self._outlines)}", 2.5, colour)
            flat = np.column_stack([corners, np.full(len(corners), view.ground)])
            self._outlines[name].points = _closed([flat], _LIFT)
        for name, handle in self._outlines.items():
            _assign(handle, visible=shown.regions and name in found)

    def _show_loads(self, view: View) -> None:
        if self._loads is None and len(view.load_points):
            self._loads = self._scene.add_arrows(
                "/loads",
                np.zeros((1, 2, 3), np.float32),
                _for_arrows(LOADED),
                shaft_radius=0.7 * self._unit,
                head_radius=1.6 * self._unit,
                head_length=3.0 * self._unit,
            )
        if self._loads is None:
            return
        _assign(self._loads, visible=len(view.load_points) > 0)
        if len(view.load_points):
            # The arrow points at where it pushes; the largest is a fifth of the robot long.
            size = max(float(np.linalg.norm(view.load_forces, axis=1).max()), 1e-9)
            tails = view.load_points - view.load_forces * (0.2 * self.height / size)
            self._loads.points = np.stack([tails, view.load_points], axis=1).astype(np.float32)

    def _show_labels(self, view: View, shown: Shown) -> None:
        texts = _labels(view, shown)
        for name, (text, place) in texts.items():
            if name not in self._labels:
                self._labels[name] = self._scene.add_label(
                    f"/label/{len(self._labels)}", text, font_screen_scale=0.8
                )
            _assign(self._labels[name], text=text, visible=True)
            self._labels[name].position = place
        for name in self._labels.keys() - texts.keys():
            _assign(self._labels[name], visible=False)

    def _lines(self, name: str, width: float, colour: Colour) -> Any:
        return self._scene.add_line_segments(
            name, np.zeros((1, 2, 3), np.float32), colour, thickness=width, thickness_units="screen"
        )

    def _ball(self, name: str, radius: float, colour: Colour) -> Any:
        return self._scene.add_icosphere(
            name, radius, colour, subdivisions=2, cast_shadow=False, receive_shadow=False
        )


def _forces(view: View) -> np.ndarray:
    first: CriterionView | None = next(iter(view.criteria), None)
    return np.zeros((0, 3)) if first is None else np.asarray(first.forces)


def _efforts(view: View, criterion: str) -> dict[str, float]:
    """Share of its limit of each joint's torque, or of the largest torque where it has none."""
    found = next((each for each in view.criteria if each.name == criterion), None)
    if found is None:
        return {}
    largest = max(float(np.abs(found.torques).max(initial=0.0)), 1e-9)
    shares = np.where(np.isfinite(found.effort), found.effort, np.abs(found.torques) / largest)
    return dict(zip(view.torque_names, shares.tolist(), strict=True))


def _labels(view: View, shown: Shown) -> dict[str, tuple[str, np.ndarray]]:
    """What each label says, and where it is in the world."""
    found = next((each for each in view.criteria if each.name == shown.criterion), None)
    if found is None:
        return {}
    texts = {}
    if shown.labels == CONTACTS:
        for k, name in enumerate(view.contacts):
            text = f"{name}: {100 * found.load_share[k]:.1f} %"
            texts[f"contact {name}"] = text, view.placements[k, :3]
    wanted = set(shown.pinned)
    order = np.argsort(-np.abs(found.torques))
    if shown.labels in (LARGEST, JOINTS):
        count = _LARGEST if shown.labels == LARGEST else len(order)
        wanted |= {view.torque_names[i] for i in order[:count]}
    for i, name in enumerate(view.torque_names):
        joint = name if name in view.joints else name.partition("[")[0]
        if joint in view.joints and wanted & {name, joint}:
            effort = "" if np.isnan(found.effort[i]) else f" ({100 * found.effort[i]:.0f} %)"
            text = f"{name}: {found.torques[i]:.1f} {view.torque_units[i]}{effort}"
            texts[f"joint {name}"] = text, view.poses[view.joints.index(joint), :3]
    return texts


def _for_arrows(colour: Colour) -> Colour:
    """A colour as arrows have to be given it: viser 1.1 takes theirs to be linear, not sRGB."""
    share = np.array(colour) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    r, g, b = (int(value) for value in np.round(255 * linear))
    return r, g, b


def _closed(outlines: Sequence[np.ndarray], lift: float) -> np.ndarray:
    """Outlines as segments, each back to where it began."""
    parts = [
        np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        for corners in outlines
        if len(corners) > 1
    ]
    found = np.vstack(parts) if parts else np.zeros((1, 2, 3))
    return np.asarray(found + np.array([0.0, 0.0, lift]), np.float32)


def _assign(handle: Any, **values: Any) -> None:
    """Assign what differs: each assignment is a message to every browser."""
    for name, value in values.items():
        old = getattr(handle, name)
        if not (
            old is value or (old is not None and value is not None and np.array_equal(old, value))
        ):
            setattr(handle, name, value)
