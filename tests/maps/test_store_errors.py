"""A store that cannot be used: one error that says why, and nothing touched."""

import errno
import json
import os

import pytest
import zarr

import copsense
from copsense.errors import OutputError
from copsense.maps import Sample
from copsense.maps.store import open_map


def _snapshot(path):
    return {p: p.read_bytes() for p in path.rglob("*") if p.is_file()}


def test_other_parameters_are_rejected_with_what_differs(whole, icub, both, sample):
    before = _snapshot(whole[0])
    other = Sample(sample.axes, len(sample), seed=4)
    huge = Sample(sample.axes, 300, seed=3 + 2**70)
    for changed, word in [
        ({"sampling": other}, r"samples of seed 3 \[m, rad\], and asked for is .* of seed 4 "),
        ({"sampling": huge}, rf"samples of seed 3 .* of seed {huge.seed} "),
        ({"chunk": 64}, r"chunk is 32 there, 64 here"),
        ({"limits": copsense.Limits()}, r"limits is null there"),
        ({"criteria": both[:1]}, r'criteria is \["minimum-wrench", "minimum-torque"\] there'),
        ({"criteria": [copsense.minimum_wrench(0.5), both[1]]}, r"criteria\[0\].*weights"),
        ({"configurations": True}, r"configurations is false there, true here"),
    ]:
        given = {"sampling": sample, "criteria": both, "chunk": 32} | changed
        with pytest.raises(OutputError, match=word):
            copsense.map_postures(icub, path=whole[0], **given)
    assert _snapshot(whole[0]) == before


def test_another_robot_or_posture_is_rejected(whole, icub, both, sample, stance_of):
    moved = copsense.load_stance("icub", posture={"torso_yaw": 0.1})
    with pytest.raises(OutputError, match=r"configuration\["):
        copsense.map_postures(moved, sample, both, whole[0], chunk=32)
    heavy = icub.robot.model.copy()
    heavy.inertias[5].mass *= 1.001
    robot = copsense.Robot.from_model(heavy, name=icub.robot.name)
    with pytest.raises(OutputError, match=r"the robot's model, its drives or its loads are others"):
        copsense.map_postures(
            copsense.Stance(robot, icub.q, icub.contacts), sample, both, whole[0], chunk=32
        )


def test_a_store_holds_its_criteria(whole, both):
    stored = open_map(whole[0]).parameters["criteria"]
    assert [copsense.Criterion.from_dict(c) for c in stored] == both


@pytest.mark.parametrize("what", ["file", "folder", "zarr", "broken"])
def test_what_is_not_a_map_is_rejected_and_kept(what, icub, both, sample, tmp_path):
    path = tmp_path / "m.zarr"
    if what == "file":
        path.write_text("precious")
    elif what == "folder":
        path.mkdir()
        (path / "precious").write_text("text")
    elif what == "zarr":
        zarr.create_group(path, zarr_format=3).create_array("x", shape=(3,), dtype="f8")
    else:
        path.mkdir()
        (path / "zarr.json").write_text("{")
    before = _snapshot(tmp_path)
    with pytest.raises(OutputError, match="is not a map of copsense"):
        copsense.map_postures(icub, sample, both, path)
    assert _snapshot(tmp_path) == before


def test_a_store_of_another_format_says_so(whole, icub, both, sample, tmp_path):
    import shutil

    path = tmp_path / "m.zarr"
    shutil.copytree(whole[0], path)
    group = zarr.open_group(path, mode="r+")
    parameters = json.loads(group.attrs["copsense_map"]) | {"format": 99}
    group.attrs["copsense_map"] = json.dumps(parameters)
    for use in (
        lambda: copsense.map_postures(icub, sample, both, path, chunk=32),
        lambda: copsense.load_map(path),
        lambda: copsense.maps.map_summary(path),
    ):
        with pytest.raises(OutputError, match=r"of format 99.*format 6, which.*Give another path"):
            use()


def test_a_full_disk_is_one_error_and_the_map_goes_on_after_it(
    whole, icub, both, sample, tmp_path, monkeypatch, same
):
    path, plain, writes = tmp_path / "m.zarr", zarr.storage.LocalStore.set, []

    async def full(self, *arguments, **keywords):
        writes.append(arguments[0])
        if len(writes) > 120:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        await plain(self, *arguments, **keywords)

    monkeypatch.setattr(zarr.storage.LocalStore, "set", full)
    with pytest.raises(OutputError, match=r"No space left .* chunks that are done are kept; free"):
        copsense.map_postures(icub, sample, both, path, chunk=32)
    monkeypatch.undo()
    assert 0 < copsense.maps.map_summary(path).chunks_done < 10
    copsense.map_postures(icub, sample, both, path, chunk=32)
    assert same(path, whole[0])


def test_a_disk_full_from_the_start_leaves_nothing(icub, both, sample, tmp_path, monkeypatch):
    async def full(self, *arguments, **keywords):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(zarr.storage.LocalStore, "set", full)
    with pytest.raises(OutputError, match="No space left"):
        copsense.map_postures(icub, sample, both, tmp_path / "m.zarr")
    assert not list(tmp_path.iterdir())


def test_no_map_to_read_says_how_to_make_one(tmp_path):
    with pytest.raises(OutputError, match="copsense map ROBOT"):
        copsense.load_map(tmp_path / "m.zarr")
