"""Motors, springs, couplings and loops from the command line are those of `Drives`."""

import json

import numpy as np
import pytest
from support.commands import copsense as run
from support.driven_files import urdf
from support.walkers import BIPED, walker

import copsense
from copsense.cli.drive_options import read_drives
from copsense.drives import Coupling, Drives, Loop, Spring
from copsense.errors import CopsenseError

ROBOT = copsense.load_robot(urdf(rods=True))


def drives(**given):
    names = ("passive", "motors", "springs", "couplings", "loops")
    return read_drives(ROBOT, **{name: given.get(name, ()) for name in names})


def test_each_option_is_what_it_says():
    assert drives(springs=["l_knee=40:5deg", "r_knee=7"]).springs == {
        "l_knee": Spring(40.0, np.radians(5)),
        "r_knee": Spring(7.0),
    }
    assert drives(couplings=["r_yaw=-1*l_yaw-2"]).couplings == (
        Coupling("r_yaw", "l_yaw", -1.0, -np.radians(2)),
    )
    assert drives(couplings=["r_yaw=.5*l_yaw"]).couplings == (Coupling("r_yaw", "l_yaw", 0.5),)
    assert drives(loops=["l_rod=l_foot:weld", "r_rod=r_foot"]).loops == (
        Loop("l_rod", "l_foot", "weld"),
        Loop("r_rod", "r_foot", "ball"),
    )
    without = drives(passive=["l_ankle", "r_ankle"])
    assert without.motors == tuple(j for j in ROBOT.joint_names if j not in ("l_ankle", "r_ankle"))
    idle = ROBOT.with_drives(without)
    back = read_drives(idle, (), ["l_ankle"], (), ["l_knee=1*r_knee"], ())
    assert set(without.motors) - set(back.motors) == {"l_knee"}
    assert set(back.motors) - set(without.motors) == {"l_ankle"}
    assert not drives()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"passive": ["ankle"]}, "l_ankle"),
        ({"springs": ["l_knee"]}, "JOINT=STIFFNESS"),
        ({"springs": ["l_knee=stiff"]}, "JOINT=STIFFNESS"),
        ({"springs": ["l_knee=4:5kg"]}, "5kg"),
        ({"couplings": ["r_yaw=l_yaw"]}, "RATIO"),
        ({"couplings": ["r_yaw=1*yaw"]}, "l_yaw"),
        ({"couplings": ["r_yaw=1*r_yaw"]}, "itself"),
        ({"loops": ["l_rod"]}, "FRAME_B"),
        ({"loops": ["l_rod=l_foot:rope"]}, "weld"),
    ],
)
def test_what_is_not_understood_is_rejected(given, said):
    with pytest.raises(CopsenseError, match=said):
        drives(**given)


def test_the_command_takes_them(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(), encoding="utf-8")
    bent = [
        word
        for s in "lr"
        for joint, angle in (("hip", -20), ("knee", 40), ("ankle", -20))
        for word in ("--posture", f"{s}_{joint}={angle}")
    ]
    said = run(
        "analyse",
        str(path),
        *("--contact", "l_foot", "--contact", "r_foot", "--contact-at", "sole", *bent),
        *("--couple", "r_yaw=1*l_yaw", "--spring", "l_knee=30:20deg", "--json"),
    )
    stance = copsense.load_stance(
        path,
        contacts=["l_foot", "r_foot"],
        contact_at="sole",
        posture={k.split("=")[0]: np.radians(float(k.split("=")[1])) for k in bent[1::2]},
        drives=Drives(
            couplings=(Coupling("r_yaw", "l_yaw"),),
            springs={"l_knee": Spring(30.0, np.radians(20))},
        ),
    )
    wanted = json.loads(json.dumps(copsense.analyse(stance).to_dict()))
    assert said.json["criteria"] == wanted["criteria"]


def test_a_loop_that_joints_cannot_close_and_a_locked_joint_are_said(tmp_path):
    path = tmp_path / "walker.urdf"
    path.write_text(walker())
    feet = [word for foot in BIPED for word in ("--contact", foot)]
    answer = run("analyse", path, *feet, "--contact-at", "sole", "--loop", "trunk@0:0:2=l_foot")
    assert answer.code == 2
    assert "trunk - l_foot" in answer.err
    assert "cannot be closed: the joints leave" in answer.err
    answer = run("analyse", path, *feet, "--lock", "l_knee", "--posture", "l_knee=20")
    assert answer.code == 2
    assert "'l_knee' is fixed in the file, or locked" in answer.err
    answer = run("analyse", path, *feet, "--contact-at", "sole", "--width", "0.04")
    assert answer.err.count("lie in each other") == 1  # a note is said once
