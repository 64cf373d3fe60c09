"""Logs that cannot be meant: one clear error, or a named gap."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import log_files
from support.commands import copsense as command
from support.results import small_log

import copsense
from copsense.errors import CopsenseError, InvalidInputError, LogReadError, UnknownNameError
from copsense.logs import LogMap, WrenchSeries, apart, collecting, compare_log, read_log
from copsense.logs.one_clock import gaps, ordered

ROWS = 200


@pytest.fixture(scope="module")
def made(icub):
    return small_log(icub)


def columns(rows=ROWS):
    """A table of two joints and a normal force, with a little noise on it."""
    t = np.arange(rows) * 0.01
    noise = np.random.default_rng(0).normal(size=rows) * 0.01
    return {
        "time": t,
        "l_knee": -0.4 + 0.01 * np.sin(t),
        "r_knee": -0.4 + 0.01 * np.cos(t),
        "l_sole_fz": 160.0 + noise,
    }


def read_table(path, icub, table, **options):
    import pandas as pd

    pd.DataFrame(table).to_csv(path, index=False)
    return read_log(path, robot=icub.robot, **options)


def kinds(log):
    return {finding.kind for finding in log.findings}


def error_of(call, kind=InvalidInputError):
    with pytest.raises(kind) as caught:
        call()
    return str(caught.value)


def test_a_joint_that_the_robot_lacks(made, icub):
    names = ("l_kneee", *made.joint_names[1:])
    message = error_of(
        lambda: compare_log(replace(made, joint_names=names), icub), UnknownNameError
    )
    assert "l_knee" in message
    assert "ignore" in message


def test_degrees_taken_for_radians(made, icub):
    degrees = replace(made, positions=np.degrees(made.positions))
    assert 'unit = "deg"' in error_of(lambda: compare_log(degrees, icub))


def test_degrees_that_are_said_are_radians(tmp_path, icub):
    table = columns()
    right = read_table(tmp_path / "a.csv", icub, table)
    for joint in ("l_knee", "r_knee"):
        table[joint] = np.degrees(table[joint])
    said = {
        "time": {"key": "time"},
        "joints": {"positions": {"l_knee": "l_knee", "r_knee": "r_knee"}, "unit": "deg"},
    }
    log = read_table(tmp_path / "b.csv", icub, table, log_map=LogMap.from_dict(said))
    np.testing.assert_allclose(log.positions, right.positions, atol=1e-12)


def test_a_wrench_in_a_frame_that_is_not_there(made, icub):
    sensors = (replace(made.wrenches[0], frame="l_soel"), made.wrenches[1])
    message = error_of(lambda: compare_log(replace(made, wrenches=sensors), icub), UnknownNameError)
    assert "Did you mean l_sole" in message


def test_a_dead_sensor_is_named_and_its_rows_left_out(tmp_path, icub):
    table = columns()
    table["l_sole_fz"][60:140] = 160.0
    log = read_table(tmp_path / "log.csv", icub, table)
    (found,) = [f for f in log.findings if f.kind == "dead sensor"]
    assert (found.start, found.stop) == pytest.approx((0.6, 1.39))
    missing = np.isnan(log.wrenches[0].values[:, 2])
    assert missing.sum() == 80
    assert missing[60:140].all()


def whole_sensor(rows=ROWS):
    """The table with six numbers of l_sole, all of which change."""
    noise = np.random.default_rng(1).normal(size=(6, rows))
    names = [f"l_sole_{n}" for n in log_files.NUMBERS]
    return columns(rows) | dict(zip(names, noise, strict=True))


def test_a_component_that_is_stuck_alone_is_dead(tmp_path, icub):
    table = whole_sensor()
    table["l_sole_fz"][60:140] = 160.0
    table["l_sole_mx"][:] = 0.3
    table["l_sole_mz"][:] = 0.0  # not measured, as many sensors' moments about z
    table["l_sole_fx"] = np.round(table["l_sole_fx"] * 0.2)  # coarse, and seldom changes
    log = read_table(tmp_path / "log.csv", icub, table)
    dead = [f.message for f in log.findings if f.kind == "dead sensor"]
    assert len(dead) == 2
    assert "force_z of the sensor 'l_sole' repeats one number at 80 rows, 0.6 to 1.39 s" in dead[0]
    assert "have no moment_x" in dead[1]
    missing = np.isnan(log.wrenches[0].values)
    assert missing.sum(axis=0).tolist() == [80, 80, 80, 200, 80, 80]


def test_infinite_forces_are_missing(tmp_path, icub):
    table = columns()
    table["l_sole_fz"][50:60] = np.inf
    log = read_table(tmp_path / "log.csv", icub, table)
    assert np.isnan(log.wrenches[0].values[50:60, 2]).all()
    assert not np.isinf(log.wrenches[0].values).any()


def test_words_among_numbers_are_named(tmp_path, icub):
    table = columns()
    table["l_knee"] = [*table["l_knee"][:-2], "err", "err"]
    table["mode"] = ["walk"] * ROWS  # of no interest
    log = read_table(tmp_path / "log.csv", icub, table)
    assert any("2 entries of the column 'l_knee', such as 'err'" in note for note in log.notes)
    table["time"] = [f"00:00:{t:05.2f}" for t in table["time"]]
    message = error_of(lambda: read_table(tmp_path / "log.csv", icub, table), LogReadError)
    assert "'time' of log.csv holds no number; it begins with '00:00:00.00'" in message


def test_times_in_milliseconds(tmp_path, icub, made):
    table = columns()
    said = {"Time [ms]": 1e3 * table.pop("time")} | table
    log = read_table(tmp_path / "log.csv", icub, said)
    np.testing.assert_allclose(log.times[-1], (ROWS - 1) * 0.01)
    unsaid = replace(made, times=1e3 * made.times)
    (doubt,) = [f for f in compare_log(unsaid, icub).findings if f.kind == "clock"]
    assert "50 s apart: the times may be in ms" in doubt.message


def test_a_log_too_large_at_100_hertz_is_thinned_further(tmp_path, icub, monkeypatch):
    monkeypatch.setattr(collecting, "LARGEST", 3 * ROWS)
    log = read_table(tmp_path / "log.csv", icub, columns())
    assert log.step == pytest.approx(0.05)
    assert any("read at 20 Hz" in note for note in log.notes)
    monkeypatch.setattr(collecting, "LARGEST", 3)
    message = error_of(lambda: read_table(tmp_path / "log.csv", icub, columns()), LogReadError)
    assert "cut the log" in message


def test_a_long_log_keeps_the_frequency_of_its_sway(made, icub):
    """Rows evenly chosen from all of it, 10.05 s apart, would show a sway of 20 s."""
    times = np.arange(40 * 101) * 0.05
    sensors = tuple(replace(w, values=np.tile(w.values, (101, 1))) for w in made.wrenches)
    positions = np.tile(made.positions, (101, 1))
    long = replace(made, times=times, positions=positions, torques=None, wrenches=sensors)
    found = compare_log(long, icub, [copsense.minimum_torque()], postures=20, skip=0.0)
    assert found.sway.frequency == pytest.approx(1.0, abs=0.1)
    assert any("rows farther apart would not show a sway of 1 Hz" in n for n in found.notes)


def test_a_sensor_dead_all_along_ends_the_comparison(made, icub):
    dead = WrenchSeries("l_sole", "l_sole", "", "sole", np.full((40, 6), np.nan))
    log = replace(made, wrenches=(dead, made.wrenches[1]))
    assert "no normal force of 'l_sole'" in error_of(lambda: compare_log(log, icub))


def test_stretches_of_nan_are_named(tmp_path, icub):
    table = columns()
    table["l_knee"][50:70] = np.nan
    table["l_sole_fz"][100:105] = np.nan
    log = read_table(tmp_path / "log.csv", icub, table)
    missing = {f.about: f for f in log.findings if f.kind == "missing"}
    assert missing["the joints"].start == pytest.approx(0.5)
    assert missing["the joints"].stop == pytest.approx(0.69)
    assert "5 rows" in missing["the sensor 'l_sole'"].message
    assert np.isnan(log.positions[50:70, 0]).all()
    assert np.isfinite(log.positions[70:]).all()


def test_a_clock_that_jumps_backwards_is_named(tmp_path, icub):
    table = columns()
    table["time"][100:] -= 0.2
    log = read_table(tmp_path / "log.csv", icub, table)
    (found,) = [f for f in log.findings if f.kind == "clock"]
    assert "backwards, by up to 0.19" in found.message
    assert (np.diff(log.times) > 0).all()


def test_a_clock_that_runs_backwards_is_an_error(tmp_path, icub):
    table = columns()
    table["time"] = table["time"][::-1]
    assert "runs backwards" in error_of(lambda: read_table(tmp_path / "log.csv", icub, table))


def test_a_clock_that_was_set_is_an_error(tmp_path, icub):
    table = columns()
    table["time"][3:] += 1.6e9
    message = error_of(lambda: read_table(tmp_path / "log.csv", icub, table))
    assert "jumps ahead by 1.6e+09 s after 3 of 200 rows" in message


def test_a_gap_stays_a_gap(tmp_path, icub):
    table = {key: np.delete(values, slice(80, 120)) for key, values in columns().items()}
    log = read_table(tmp_path / "log.csv", icub, table)
    assert kinds(log) == {"gap"}
    assert len(log.times) == ROWS
    assert np.flatnonzero(np.isnan(log.positions[:, 0])).tolist() == list(range(80, 120))


def test_samples_that_came_late_are_spread_over_their_steps():
    t = np.arange(100) * 0.01
    received = t.copy()
    received[40:60] = 0.595 + np.arange(20) * 1e-5
    clock = ordered("t", received, "the log")
    assert clock.findings[0].kind == "clock"
    assert np.abs(clock.times - t).max() < 0.02
    assert not gaps(clock, "the log")


def test_a_foot_in_the_air_is_named_and_left_out(made, icub):
    forces = np.array(made.wrenches[1].values)
    forces[10:20] = 0.0
    lifted = replace(made.wrenches[1], values=forces)
    found = compare_log(replace(made, wrenches=(made.wrenches[0], lifted)), icub, skip=0.0)
    (finding,) = [f for f in found.findings if f.kind == "unloaded"]
    assert finding.about == "r_sole"
    assert len(found.times) == 30


def test_a_foot_in_the_air_all_along(made, icub):
    lifted = replace(made.wrenches[1], values=np.zeros((40, 6)))
    log = replace(made, wrenches=(made.wrenches[0], lifted))
    assert "r_sole at 0" in error_of(lambda: compare_log(log, icub))


def test_forces_of_the_robot_on_the_ground(made, icub):
    turned = tuple(replace(w, values=-w.values) for w in made.wrenches)
    assert "sign = -1" in error_of(lambda: compare_log(replace(made, wrenches=turned), icub))


def test_feet_whose_sensors_are_exchanged_are_doubted(made, icub):
    def signs(log):
        findings = compare_log(log, icub, skip=0.0).findings
        return [f.message for f in findings if f.kind == "sign"]

    a, b = made.wrenches
    exchanged = (replace(a, values=b.values), replace(b, values=a.values))
    assert not signs(made)
    (message,) = signs(replace(made, wrenches=exchanged))
    assert "exchanged" in message


def test_forces_that_do_not_carry_the_weight(made, icub):
    heavy = tuple(replace(w, values=1.1 * w.values) for w in made.wrenches)
    found = compare_log(replace(made, wrenches=heavy), icub, skip=0.0)
    (finding,) = [f for f in found.findings if f.kind == "total"]
    assert "+10.0%" in finding.message
    kilograms = tuple(replace(w, values=w.values / 9.81) for w in made.wrenches)
    found = compare_log(replace(made, wrenches=kilograms), icub, skip=0.0)
    assert any("kilograms" in f.message for f in found.findings)


def test_a_leg_joint_that_the_log_has_not(made, icub):
    keep = [n != "l_knee" for n in made.joint_names]
    log = replace(
        made,
        joint_names=tuple(np.array(made.joint_names)[keep]),
        positions=made.positions[:, keep],
        torques=None,
    )
    assert "lacks l_knee" in error_of(lambda: compare_log(log, icub))


def test_a_mapping_to_nothing(tmp_path, icub):
    said = {"time": {"key": "time"}, "joints": {"positions": {"l_knee": "left_knee"}}}
    message = error_of(
        lambda: read_table(tmp_path / "log.csv", icub, columns(), log_map=LogMap.from_dict(said)),
        UnknownNameError,
    )
    assert "left_knee" in message
    assert "l_knee" in message


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"joints": {}}, "positions"),
        ({"joints": {"positions": "q"}, "tiem": {}}, "Did you mean time"),
        ({"joints": {"positions": "q", "unit": "grad"}}, "unit of joints"),
        ({"joints": {"positions": "q"}, "wrenches": [{"contact": "l"}]}, "no normal force"),
        ({"joints": {"positions": "q"}, "wrenches": [{"force_z": "f"}]}, "which contact"),
        (
            {
                "joints": {"positions": "q"},
                "wrenches": [{"contact": "l", "wrench": "w", "sign": 2}],
            },
            "sign",
        ),
        ({"joints": {"positions": "q"}, "base": {"position": "p"}}, "rotation"),
    ],
)
def test_mappings_that_make_no_sense(data, words):
    assert words in error_of(lambda: LogMap.from_dict(data), CopsenseError)


WRITERS = {
    "log.csv": log_files.write_csv,
    "log.parquet": log_files.write_parquet,
    "v5.mat": log_files.write_matlab5,
    "v73.mat": log_files.write_matlab73,
    "ros1.bag": log_files.write_bag,
    "ros2_mcap": log_files.write_bag,
    "plates.c3d": log_files.write_c3d,
    "own.nc": None,
}


APART = ("v5.mat", "plates.c3d")  # read in processes of their own


@pytest.fixture(scope="module")
def whole_files(data, sway_file, tmp_path_factory):
    """The bytes of a short log in each format."""
    folder, found = tmp_path_factory.mktemp("whole"), {}
    short = log_files.first(data, 12)
    for name, write in WRITERS.items():
        if write is None:
            found[name] = sway_file.read_bytes()
            continue
        write(folder / name, short)
        path = folder / name
        if path.is_dir():
            (path,) = path.glob("*.mcap")
        found[path.name] = path.read_bytes()
    return found


def test_files_cut_short_are_one_clear_error(whole_files, icub, tmp_path):
    contacts = ("l_sole", "r_sole")
    for name, content in whole_files.items():
        path, size = tmp_path / name, len(content)
        rejected = 0
        for share in (0.05, 0.4, 0.8, 0.99):
            path.write_bytes(content[: int(size * share)])
            try:
                read_log(path, robot=icub.robot, contacts=contacts)
            except CopsenseError:  # and no other error
                rejected += 1
        assert rejected or name.endswith("csv"), name


def test_damaged_files_are_rejected_in_words_or_read_as_far_as_they_go(
    whole_files, icub, monkeypatch
):
    """A short run of benchmarks/log_mutations.py."""
    path = Path(__file__).parents[2] / "benchmarks" / "log_mutations.py"
    monkeypatch.syspath_prepend(path.parent)
    spec = importlib.util.spec_from_file_location("log_mutations", path)
    mutations = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(mutations)
    for name in whole_files:
        count = 2 if name in APART else 7  # none through the command, which takes longer
        counts, bad = mutations.run(name, whole_files, count, 1, icub.robot)
        assert not bad
        assert counts["accepted"] + counts["rejected"] == count


def test_files_that_are_no_logs(tmp_path):
    def message(name, content):
        path = tmp_path / name
        path.write_bytes(content)
        return error_of(lambda: read_log(path), LogReadError)

    assert "no log at" in error_of(lambda: read_log(tmp_path / "none.csv"), LogReadError)
    assert "known suffix" in message("a.xlsx", b"1")
    assert "empty" in message("a.csv", b"")
    assert "no heading" in message("b.csv", b"1,2\n3,4\n")
    assert "several columns" in message("c.csv", b"a,a\n3,4\n")
    for name in ("a.mat", "a.parquet", "a.bag", "a.mcap", "a.c3d", "a.nc", "a.db3"):
        assert "a." in message(name, b"not what its name says" * 100)
    assert "pos.csv" in error_of(lambda: read_log(tmp_path), LogReadError)


def test_the_command_says_one_line(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,a\n0,1\n1,2\n", encoding="utf-8")
    assert "--map" in command("log", path, "--robot", "icub").error
    assert "no log at" in command("log", tmp_path / "b.csv", "--robot", "icub").error
    assert "no mapping at" in command("log", path, "--robot", "icub", "--map", "none.toml").error


def test_a_mapping_is_written_by_a_comparison_that_succeeds_alone(tmp_path):
    import pandas as pd

    kept, path = tmp_path / "kept.toml", tmp_path / "a.csv"
    run = ("log", path, "--robot", "icub", "--save-map", kept)
    table = columns()
    pd.DataFrame(table).to_csv(path, index=False)
    assert "error" in command(*run).err  # the legs' other joints are not there
    assert not kept.exists()
    robot = copsense.load_stance("icub").robot
    table = dict.fromkeys(robot.joint_names, table["l_knee"]) | table
    table["r_sole_fz"] = table["l_sole_fz"]
    pd.DataFrame(table).to_csv(path, index=False)
    answer = command(*run, "--skip", "0", "--json")
    assert answer.code == 0, answer.err
    assert LogMap.load(kept) is not None


def test_a_log_shorter_than_a_tenth_of_a_second_has_no_slopes(tmp_path, made, icub):
    short = replace(
        made,
        times=made.times / 50,
        positions=made.positions,
    )
    found = compare_log(short, icub, skip=0.0)
    assert found.sway.method == "regression"


@pytest.mark.parametrize(("name", "remedy"), [("v5.mat", "-v7.3"), ("plates.c3d", "markers")])
def test_files_that_are_read_whole_have_a_size_that_is_named(
    whole_files, tmp_path, monkeypatch, name, remedy
):
    path = tmp_path / name
    path.write_bytes(whole_files[name])
    monkeypatch.setattr(apart, "_LARGEST", 1000)
    said = error_of(lambda: read_log(path), LogReadError)
    assert "is read whole, and the most is 1e-06 GB" in said
    assert remedy in said
