"""A link, a site and a joint may share a name: the link's frame is meant, then the site's."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support import commands
from support.tiny import FEET, MJCF, broken

import copsense
from copsense.errors import UnknownNameError
from copsense.simulation import Push, Scenario
from copsense.simulation.push_forces import PushForces
from copsense.simulation.simulator import Snapshot

# The joint of each leg takes its link's name; URDF and MJCF both allow it.
URDF = broken('joint name="left_hip"', 'joint name="left"').replace(
    'joint name="right_hip"', 'joint name="right"'
)
SHARED = MJCF.replace('"left_hip"', '"left"').replace('"right_hip"', '"right"')


@pytest.mark.parametrize("text", [URDF, SHARED], ids=["urdf", "mjcf"])
def test_a_name_shared_by_link_and_joint_is_the_links(text):
    stance = copsense.load_stance(text, contacts=FEET, contact_at="sole")
    assert stance.robot.joint_names == ("left", "right")
    for foot in FEET:
        assert stance.robot.frame(foot).type == pin.FrameType.BODY
    assert copsense.solve_equilibrium(stance, copsense.minimum_wrench(1.0)).residual() < 1e-10


def test_a_push_acts_at_the_link_of_a_shared_name():
    plain, shared = (
        copsense.load_stance(text, contacts=FEET, contact_at="sole")
        for text in (broken("", ""), URDF)
    )
    forces = []
    for stance in (plain, shared):
        push = Scenario(pushes=(Push((1.0, 2.0, 3.0), start=0.0, frame="left"),))
        push.check_stance(stance)
        feet = np.zeros((2, 6)), np.zeros((2, 3)), np.zeros((2, 3, 3))
        now = Snapshot(0.0, stance.q, np.zeros(stance.robot.model.nv), *feet)
        forces.append(PushForces(push, stance, 1e-3).at(now))
    assert np.abs(forces[0]).max() > 1
    assert np.array_equal(*forces)


@pytest.mark.parametrize(
    ("kinds", "meant"),
    [
        (("JOINT", "OP_FRAME", "BODY"), "BODY"),
        (("JOINT", "FIXED_JOINT", "OP_FRAME"), "OP_FRAME"),
        (("JOINT", "FIXED_JOINT"), "FIXED_JOINT"),
    ],
)
def test_links_come_before_sites_and_sites_before_joints(kinds, meant):
    model = copsense.load_robot(broken("", "")).model.copy()
    for number, kind in enumerate(kinds):
        place = pin.SE3(np.eye(3), np.full(3, float(number)))
        model.addFrame(pin.Frame("shared", 1, 0, place, getattr(pin.FrameType, kind)))
    frame = copsense.load_robot(model).frame("shared")
    assert frame.type == getattr(pin.FrameType, meant)
    with pytest.raises(UnknownNameError, match=r"'shard'.*Did you mean shared"):
        copsense.load_robot(model).frame_id("shard")


def test_notes_on_a_robots_file_are_printed_once_and_are_in_the_json(tmp_path, monkeypatch):
    from copsense import robots

    load, note = robots.load_robot, "equality 'loop' (connect) between 'a' and 'b' is not used"

    def noted(*arguments, **options):
        return replace(load(*arguments, **options), notes=(note,))

    path = tmp_path / "tiny.xml"
    path.write_text(MJCF)
    monkeypatch.setattr(robots, "load_robot", noted)
    words = ["analyse", path, "--contact", "left", "--contact", "right", "--contact-at", "sole"]
    words += ["--criterion", "minimum-wrench"]
    printed = commands.copsense(*words)
    assert (printed.code, printed.err.count(note)) == (0, 1)
    assert commands.copsense(*words, "--json").json["notes"].count(note) == 1
