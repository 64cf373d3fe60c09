"""write_video: a recording as a film, drawn off-screen by MuJoCo.

The only module that imports the video encoder. Links are drawn as capsules between joints, soles as
outlines, centres of pressure and of mass as balls.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from copsense.errors import InvalidInputError, OutputError
from copsense.extras import require
from copsense.files import check_output, write_beside
from copsense.simulation.mujoco_simulator import load_mujoco
from copsense.simulation.recording import Recording
from copsense.skeleton import links
from copsense.stance import Stance

_RATE = 25  # frames a second
_WIDE, _HIGH = 640, 640
_MOST = 4000  # frames
_LINK, _FOOT, _COP, _COM = (
    (0.62, 0.68, 0.74, 1.0),
    (0.36, 0.42, 0.48, 1.0),
    (0.84, 0.37, 0.0, 1.0),
    (0.0, 0.45, 0.7, 1.0),
)


def write_video(
    stance: Stance,
    recording: Recording,
    path: str | Path,
    *,
    overwrite: bool = False,
    progress: Callable[[int], object] | None = None,
) -> Path:
    """Draw a recording as an MP4 film at the speed it happened.

    Args:
        stance: the robot and its contacts.
        recording: of a closed loop.
        path: where to write, ``.mp4``.
        overwrite: whether a file there may be replaced.
        progress: called with 1 after each frame.

    Raises:
        MissingExtraError: MuJoCo or the encoder is not installed.
        OutputError: the file cannot be written, or this machine cannot draw off-screen.
        InvalidInputError: the recording is of another robot.
    """
    path = check_output(path, suffixes=(".mp4",), overwrite=overwrite)
    encode = _encoder()
    if recording["configuration"].shape[1] != stance.robot.model.nq:
        raise InvalidInputError(
            f"the recording is of another robot than {stance.robot.name!r}: its configurations "
            f"have {recording['configuration'].shape[1]} numbers, not {stance.robot.model.nq}."
        )
    time = recording["time"].values
    count = min(max(2, round(float(time[-1] - time[0]) * _RATE) + 1), _MOST)
    rows = [int(np.argmin(np.abs(time - t))) for t in np.linspace(time[0], time[-1], count)]

    def write(temporary: Path) -> None:
        with _screen(stance) as draw:
            frames = encode(str(temporary), (_WIDE, _HIGH), fps=_RATE, macro_block_size=16)
            frames.send(None)
            try:
                for row in rows:
                    frames.send(draw(recording, row))
                    if progress:
                        progress(1)
            finally:
                frames.close()

    write_beside(path, write)
    return path


def check_video() -> None:
    """Raise where this machine cannot film.

    Raises:
        MissingExtraError: MuJoCo or the encoder is not installed.
        OutputError: this machine cannot draw off-screen.
    """
    _encoder()
    with _renderer(_scene()):
        pass


def _encoder() -> Any:
    require("imageio_ffmpeg", "writing a video")
    import imageio_ffmpeg

    return imageio_ffmpeg.write_frames


def _scene() -> Any:
    """A world with light and ground; the robot is drawn into it frame by frame."""
    mujoco = load_mujoco()
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = (
        _WIDE,
        _HIGH,
    )
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.45] * 3, [0.25] * 3
    spec.visual.headlight.specular = [0.0] * 3
    light = spec.worldbody.add_light(pos=[1.5, 1.0, 3.0], dir=[-0.4, -0.3, -1.0])
    light.diffuse, light.specular = [0.35] * 3, [0.0] * 3
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.97, 0.98, 0.99],
        rgb2=[0.80, 0.84, 0.88],
        width=64,
        height=384,
    )
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20.0, 20.0, 0.1], rgba=[0.86, 0.88, 0.90, 1.0]
    )
    return spec.compile()


@contextmanager
def _renderer(model: Any) -> Iterator[Any]:
    mujoco = load_mujoco()
    try:
        renderer = mujoco.Renderer(model, _HIGH, _WIDE)
    except Exception as error:
        raise OutputError(
            "this machine cannot draw off-screen "
            f"({type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'no GL'}; "
            f"MUJOCO_GL={os.environ.get('MUJOCO_GL', 'unset')}). Install EGL (libegl1, "
            "libgl1-mesa-dri) and set MUJOCO_GL=egl before Python starts, or leave out the video."
        ) from None
    try:
        yield renderer
    finally:
        renderer.close()


@contextmanager
def _screen(stance: Stance) -> Iterator[Callable[[Recording, int], np.ndarray]]:
    mujoco, model = load_mujoco(), stance.robot.model
    scene_model, data = _scene(), model.createData()
    scene_data = mujoco.MjData(scene_model)
    mujoco.mj_forward(scene_model, scene_data)
    camera = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(scene_model, camera)
    height = float(stance.com[2])
    camera.lookat[:] = [float(stance.com[0]), float(stance.com[1]), 0.75 * height]
    camera.distance, camera.azimuth, camera.elevation = 2.9 * height, 200.0, -18.0
    radius = 0.045 * height
    with _renderer(scene_model) as renderer:

        def draw(recording: Recording, row: int) -> np.ndarray:
            pin.forwardKinematics(model, data, recording["configuration"].values[row])
            renderer.update_scene(scene_data, camera)
            scene = renderer.scene
            for a, b in links(stance.robot):
                start, end = data.oMi[a].translation, data.oMi[b].translation
                if np.linalg.norm(end - start) > radius / 4:
                    _capsule(mujoco, scene, start, end, radius, _LINK)
            for k, contact in enumerate(stance.contacts):
                at = contact.on(stance.robot)
                place = data.oMi[at.joint] * at.placement
                ankle = data.oMi[at.joint].translation
                _capsule(mujoco, scene, ankle, place.translation, 0.7 * radius, _LINK)
                if contact.sole:
                    corners = [place.act(np.array([*p, 0.0])) for p in contact.sole.vertices]
                    for p, q in zip(corners, [*corners[1:], corners[0]], strict=True):
                        _capsule(mujoco, scene, p, q, 0.15 * radius, _FOOT)
                cop = recording["cop"].values[row, k]
                if np.all(np.isfinite(cop)):
                    _ball(mujoco, scene, place.act(np.array([*cop, 0.0])), 0.75 * radius, _COP)
            _ball(mujoco, scene, recording["com"].values[row], 0.8 * radius, _COM)
            return np.ascontiguousarray(renderer.render())

        yield draw


def _next(scene: Any) -> Any | None:
    if scene.ngeom >= scene.maxgeom:
        return None
    scene.ngeom += 1
    return scene.geoms[scene.ngeom - 1]


def _ball(
    mujoco: Any, scene: Any, at: np.ndarray, radius: float, colour: tuple[float, ...]
) -> None:
    geom = _next(scene)
    if geom is not None:
        mujoco.mjv_initGeom(
            geom,
            mujoco.mjtGeom.mjGEOM_SPHERE,
            np.array([radius, 0.0, 0.0]),
            np.asarray(at, dtype=float),
            np.eye(3).ravel(),
            np.array(colour, dtype=np.float32),
        )


def _capsule(
    mujoco: Any,
    scene: Any,
    start: np.ndarray,
    end: np.ndarray,
    radius: float,
    colour: tuple[float, ...],
) -> None:
    if np.linalg.norm(end - start) < 1e-9:
        return
    geom = _next(scene)
    if geom is not None:
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        mujoco.mjv_initGeom(
            geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), np.array(colour, dtype=np.float32)
        )
        mujoco.mjv_connector(geom, kind, radius, np.asarray(start), np.asarray(end))
