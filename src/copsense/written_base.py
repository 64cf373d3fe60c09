"""A base written into a URDF: free joints at its root, or a chain of massless links, taken out.

Copsense gives every robot a free base of its own. Joints that stand for one in the file would be
taken for joints with motors.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass

from copsense.errors import ModelLoadError
from copsense.xml_numbers import read_numbers

_LIGHT = 1e-3  # share of the robot's mass up to which a link of a virtual chain counts as massless
_CHAIN = 3  # joints from which on massless links at the root are a virtual base
_WORLDS = ("world", "map", "odom")


@dataclass(frozen=True)
class _Group:
    """Links that are fixed to each other.

    Attributes:
        links: their names.
        leaving: the joints that move away from them.
        mass: of all of them [kg].
        touches: whether one of them has collision geometry.
    """

    links: tuple[str, ...]
    leaving: tuple[ET.Element, ...]
    mass: float
    touches: bool


def take_out_base(root: ET.Element) -> tuple[str, ...]:
    """Make the first link of the robot itself the root; what was taken out, in words.

    Args:
        root: a URDF without faults; changed in place.

    Raises:
        ModelLoadError: several robots float in the file, or a joint elsewhere floats.
    """
    tree = _Tree(root)
    chain = tree.base_chain()
    notes: tuple[str, ...] = ()
    if chain:
        notes = (tree.cut(chain),)
    floating = [j.get("name", "") for j in root.findall("joint") if j.get("type") == "floating"]
    if floating:
        raise ModelLoadError(
            f"joint {floating[0]!r} floats, and it is not what joins the robot to the world: no "
            "motor can drive it, and a robot has one free base. Make it fixed, or put the part "
            "that floats into a file of its own."
        )
    return notes


class _Tree:
    """The links and joints of a URDF."""

    def __init__(self, root: ET.Element) -> None:
        self.root = root
        self.links = {link.get("name", ""): link for link in root.findall("link")}
        self.joints = root.findall("joint")
        self.leaving: dict[str, list[ET.Element]] = {name: [] for name in self.links}
        for joint in self.joints:
            self.leaving[_link(joint, "parent")].append(joint)
        children = {_link(joint, "child") for joint in self.joints}
        self.first = next(name for name in self.links if name not in children)
        self.mass = sum(map(self.mass_of, self.links))

    def mass_of(self, link: str) -> float:
        element = self.links[link].find("inertial/mass")
        numbers = read_numbers("" if element is None else element.get("value", ""))
        return numbers[0] if numbers else 0.0

    def group(self, link: str) -> _Group:
        """The links fixed to a link and those below it."""
        links, leaving = [link], []
        for name in links:  # grows
            for joint in self.leaving[name]:
                if joint.get("type") == "fixed":
                    links.append(_link(joint, "child"))
                else:
                    leaving.append(joint)
        touches = any(self.links[name].find("collision") is not None for name in links)
        return _Group(tuple(links), tuple(leaving), sum(map(self.mass_of, links)), touches)

    def base_chain(self) -> list[ET.Element]:
        """The joints between the root and the robot's first link, if they stand for a base."""
        start = group = self.group(self.first)
        chain: list[ET.Element] = []
        floats = False
        while True:
            free = [j for j in group.leaving if j.get("type") in ("floating", "planar")]
            if len(free) > 1:
                raise ModelLoadError(
                    f"joints {', '.join(repr(j.get('name')) for j in free)} are each a free base: "
                    "the file holds several robots. Give each a file of its own."
                )
            light = group.mass <= _LIGHT * self.mass and not group.touches
            onwards = free or list(group.leaving)
            if len(onwards) != 1 or not (free or light or group is start):
                break
            floats = floats or bool(free)
            chain.append(onwards[0])
            group = self.group(_link(chain[-1], "child"))
        if floats:
            return chain
        slides = sum(joint.get("type") == "prismatic" for joint in chain)
        if start.mass > _LIGHT * self.mass or start.touches:
            # Scenery that is fixed to the world, or a link of the robot such as a foot.
            world = self.first.lower() in _WORLDS
            return chain if len(chain) >= 6 or (world and slides) else []
        return chain if slides or len(chain) >= _CHAIN else []

    def cut(self, chain: list[ET.Element]) -> str:
        """Take away all but what hangs on the chain's last link; the note that says so."""
        base = _link(chain[-1], "child")
        kept = [base]
        for name in kept:  # grows
            kept += [_link(joint, "child") for joint in self.leaving[name]]
        dropped = [name for name in self.links if name not in kept]
        for name in dropped:
            self.root.remove(self.links[name])
        for joint in self.joints:
            if _link(joint, "parent") not in kept:
                self.root.remove(joint)
        joints = ", ".join(joint.get("name", "") for joint in chain)
        one = len(chain) == 1
        heavy = [f"{name} ({self.mass_of(name):g} kg)" for name in dropped if self.mass_of(name)]
        return (
            f"The base is written into the file: {'joint' if one else 'joints'} {joints} above "
            f"link {base!r} {'is' if one else 'are'} taken as the free base, which has no motors "
            "and moves in all six directions"
            + (f"; left out with {'it' if one else 'them'}: {', '.join(heavy)}" if heavy else "")
            + "."
        )


def _link(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")
