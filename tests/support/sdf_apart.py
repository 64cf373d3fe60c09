"""An SDF placed by hand: poses composed as 4 x 4 matrices, by NumPy and SciPy alone."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation


def read(source):
    """The <model> of a file or a text, and its version."""
    text = source.read_text(encoding="utf-8") if isinstance(source, Path) else source
    root = ET.fromstring(text)
    return root.find("model"), float(root.get("version"))


def numbers(element, tag, default):
    return [float(w) for w in (element.findtext(tag) or default).split()]


def pose(element):
    """4 x 4 of a <pose>: fixed axes, roll about x first."""
    found = np.eye(4)
    if element is not None:
        values = numbers(element, "pose", "0 0 0 0 0 0")
        found[:3, :3] = Rotation.from_euler("xyz", values[3:]).as_matrix()
        found[:3, 3] = values[:3]
    return found


def link_pose(model, name):
    return pose(model.find(f"link[@name='{name}']"))


def axis_at_joint(model, version, joint, tag="axis"):
    """An axis in the joint's frame."""
    axis = joint.find(tag)
    xyz = axis.find("xyz")
    vector = np.array([float(w) for w in xyz.text.split()])
    flag = axis.findtext("use_parent_model_frame", "0").strip()
    if version < 1.5 or flag in ("1", "true") or xyz.get("expressed_in") == "__model__":
        here = link_pose(model, joint.findtext("child")) @ pose(joint)
        vector = here[:3, :3].T @ vector
    return vector / np.linalg.norm(vector)


def moved(model, version, joint, q):
    """Motion of a joint in its own frame: numbers of each axis, or a ball's rotation (3 x 3)."""
    found, kind = np.eye(4), joint.get("type")
    if kind == "ball":
        found[:3, :3] = q
    elif kind == "prismatic":
        found[:3, 3] = q[0] * axis_at_joint(model, version, joint)
    elif kind != "fixed":
        for tag, angle in zip(("axis", "axis2"), q, strict=False):
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(
                angle * axis_at_joint(model, version, joint, tag)
            ).as_matrix()
            found = found @ turn
    return found


def placed(source, positions, root):
    """World 4 x 4 of every link where the root stands at the world's origin.

    Args:
        source: file or text.
        positions: joint -> its numbers, or a rotation; joints not named are at zero.
        root: name of the root link.
    """
    model, version = read(source)
    places = {root: np.eye(4)}
    joints = [j for j in model.findall("joint") if j.findtext("parent") != "world"]
    before = 0
    while len(places) != before:
        before = len(places)
        for joint in joints:
            parent, child = joint.findtext("parent"), joint.findtext("child")
            if parent not in places or child in places:
                continue
            first = next(j for j in joints if j.findtext("child") == child)
            if joint is not first:
                continue
            P = pose(joint)
            before_it = np.linalg.inv(link_pose(model, parent)) @ link_pose(model, child) @ P
            q = positions.get(joint.get("name"), np.eye(3) if joint.get("type") == "ball" else [0])
            motion = moved(model, version, joint, q)
            places[child] = places[parent] @ before_it @ motion @ np.linalg.inv(P)
    return places


def whole_body(source, places):
    """Mass, centre of mass (3,) and inertia about it (3, 3) in the world, of links so placed."""
    model, _ = read(source)
    masses, centres, inertias = [], [], []
    for link in model.findall("link"):
        inertial = link.find("inertial")
        here = places[link.get("name")] @ pose(inertial)
        inertia = None if inertial is None else inertial.find("inertia")
        values = {
            tag: 1.0 * (tag[1] == tag[2])
            if inertia is None
            else numbers(inertia, tag, str(1.0 * (tag[1] == tag[2])))[0]
            for tag in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        }
        I = np.array([[values["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
        masses.append(1.0 if inertial is None else numbers(inertial, "mass", "1")[0])
        centres.append(here[:3, 3])
        inertias.append(here[:3, :3] @ I @ here[:3, :3].T)
    m, c = np.array(masses), np.array(centres)
    com = m @ c / m.sum()
    arms = c - com
    steiner = sum(k * (a @ a * np.eye(3) - np.outer(a, a)) for k, a in zip(m, arms, strict=True))
    return m.sum(), com, sum(inertias) + steiner
