"""What a simulation recorded, written in every format and read back, is what it was."""

from dataclasses import replace

import numpy as np
import pytest
from support import log_files

from copsense.logs import JointsMap, LogMap, WrenchMap, compare_log, matlab_tree, read_log
from copsense.logs.log_statics import wrench_cops
from copsense.logs.opening import open_log_file
from copsense.logs.recognition import recognise

FORMATS = {
    "log.csv": log_files.write_csv,
    "log.parquet": log_files.write_parquet,
    "v5.mat": log_files.write_matlab5,
    "v73.mat": log_files.write_matlab73,
    "simulink.mat": log_files.write_simulink,
    "ros1.bag": log_files.write_bag,
    "ros2_mcap": log_files.write_bag,
    "ros2_sqlite": log_files.write_bag,
    "eurobench": log_files.write_eurobench,
}


@pytest.fixture(scope="module")
def read_back(icub, data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("formats")

    def read(name, **options):
        path = folder / name
        if not path.exists():
            FORMATS[name](path, data)
        if name == "simulink.mat":
            options.setdefault("log_map", LogMap.from_dict(log_files.simulink_map(data)))
        return read_log(path, robot=icub.robot, contacts=data.contacts, **options)

    read.folder = folder
    return read


def cops_of(log, contacts):
    return wrench_cops(np.stack([log.wrench(name).values for name in contacts], axis=1))


@pytest.mark.parametrize("name", FORMATS)
def test_cops_and_joints_come_back(read_back, data, name):
    log = read_back(name)
    N = len(data.t) - 1  # the last row is half a step after the one before
    assert len(log.times) == N
    np.testing.assert_allclose(log.times, data.t[:-1] - data.t[0], atol=1e-6)
    order = [log.joint_names.index(j) for j in data.joints]
    np.testing.assert_allclose(log.positions[:, order], data.q[:N], rtol=0, atol=1e-12)
    np.testing.assert_allclose(cops_of(log, data.contacts)[1:], data.cop[1:N], rtol=0, atol=1e-9)
    if name != "simulink.mat":
        np.testing.assert_allclose(log.torques[:, order], data.tau[:N], rtol=0, atol=1e-9)
        np.testing.assert_allclose(log.velocities[:, order], data.v[:N], rtol=0, atol=1e-9)


def test_a_recording_of_our_own_comes_back(sway_file, data):
    log = read_log(sway_file)
    np.testing.assert_array_equal(log.positions, data.q[:-1])
    np.testing.assert_allclose(cops_of(log, data.contacts)[1:], data.cop[1:-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(log.base[:, :3], data.base[:-1, :3], atol=1e-12)


def test_structures_of_time_and_data_are_read(icub, data, tmp_path):
    """What the message on an object of MATLAB's says to save."""
    from scipy.io import savemat

    said = matlab_tree._object("q", "an object of class timeseries")
    assert "x = struct('time', q.Time, 'data', q.Data)" in said
    signals = {"q": data.q, "left": data.w[:, 0], "right": data.w[:, 1]}
    savemat(
        tmp_path / "log.mat", {k: {"time": data.t[:, None], "data": v} for k, v in signals.items()}
    )
    wrenches = tuple(
        WrenchMap(n, {"wrench": f"{k}.data"})
        for n, k in zip(data.contacts, ("left", "right"), strict=True)
    )
    own = LogMap(JointsMap("q.data", names=data.joints), wrenches)
    log = read_log(tmp_path / "log.mat", own, robot=icub.robot)
    np.testing.assert_allclose(cops_of(log, data.contacts)[1:], data.cop[1:-1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["ros1.bag", "ros2_mcap", "eurobench"])
def test_the_base_comes_back(read_back, data, name):
    base = read_back(name).base
    np.testing.assert_allclose(base[:, :3], data.base[:-1, :3], atol=1e-9)
    same = np.abs(np.sum(base[:, 3:] * data.base[:-1, 3:], axis=1))
    np.testing.assert_allclose(same, 1.0, atol=1e-9)


def test_force_plates_come_back(icub, data, tmp_path):
    file = tmp_path / "plates.c3d"
    log_files.write_c3d(file, data)
    plates = open_log_file(file)
    (block,) = plates.blocks(["time", *plates.channels], lambda _: None)
    np.testing.assert_allclose(block["time"][:, 0], data.t[0] + 0.004 * np.arange(601), atol=1e-6)
    for k, (name, (x, y)) in enumerate(log_files.PLATES.items()):
        w = data.w[:, data.contacts.index(name)]
        moment = w[:, 3:] + np.cross((x, y, 0.0), w[:, :3])
        found = block[f"plate {k + 1}"]
        # The format holds numbers of 32 bits.
        np.testing.assert_allclose(found, np.hstack([w[:, :3], moment]), rtol=0, atol=2e-4)


def test_plates_in_a_file_of_their_own(read_back, icub, data):
    """The laboratory's plates began 0.4 s after the robot's log, on a clock of their own."""
    read_back("log.csv")
    late = log_files.first(data, 401, begin=100)
    log_files.write_c3d(read_back.folder / "plates.c3d", late)
    said = recognise(open_log_file(read_back.folder / "log.csv"), icub.robot, data.contacts)
    plates = tuple(
        WrenchMap(n, {"wrench": f"plate {k + 1}"}, kind="plate", file="plates.c3d", starts=0.4)
        for k, n in enumerate(log_files.PLATES)
    )
    own = LogMap.from_dict(replace(said, wrenches=plates).to_dict())
    log = read_back("log.csv", log_map=own)
    for name in log_files.PLATES:
        normal = log.wrench(name).values[:, 2]
        expected = data.w[:, data.contacts.index(name), 2]
        np.testing.assert_allclose(normal[100:501], expected[100:501], atol=1e-3)
        assert np.isnan(normal[:99]).all()
        assert np.isnan(normal[502:]).all()


def test_one_mcap_file_is_a_bag(read_back, data):
    read_back("ros2_mcap")
    (file,) = (read_back.folder / "ros2_mcap").glob("*.mcap")
    log = read_log(file)
    np.testing.assert_allclose(
        log.positions[:, log.joint_names.index("l_knee")], data.q[:-1, data.joints.index("l_knee")]
    )


def test_a_mapping_is_written_once_and_used_again(read_back, icub, data):
    read_back("v73.mat")
    path = read_back.folder / "v73.mat"
    recognised = recognise(open_log_file(path), icub.robot, data.contacts)
    saved = recognised.save(read_back.folder / "map.toml")
    assert LogMap.load(saved).to_dict() == recognised.to_dict()
    again = read_log(path, saved)
    np.testing.assert_array_equal(again.positions, read_back("v73.mat").positions)


def test_a_rate_gives_means_of_the_samples(read_back, data):
    step = data.t[1] - data.t[0]
    log = read_back("log.csv", rate=1 / (4 * step))
    N = len(data.t) // 4 - 1  # the last step was only begun
    assert len(log.times) == N
    expected = data.q[: 4 * N].reshape(N, 4, -1).mean(axis=1)
    order = [log.joint_names.index(j) for j in data.joints]
    np.testing.assert_allclose(log.positions[:N, order], expected, atol=1e-12)


@pytest.mark.parametrize("name", ["log.parquet", "ros2_mcap"])
def test_measured_cops_stand_beside_the_criteria(read_back, icub, data, name):
    found = compare_log(read_back(name), icub, skip=0.4, postures=60)
    at = np.searchsorted(data.t - data.t[0], found.times - 1e-4)
    np.testing.assert_allclose(found.cops, data.cop[at], rtol=0, atol=1e-9)
