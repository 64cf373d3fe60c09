"""A map holds what one posture at a time gives, however it was cut, stopped and resumed."""

import os
import re
import shutil

import numpy as np
import pytest
import xarray as xr
from support.grounds import with_hand

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.batch.statics.limit_states import LIMIT_STATES
from copsense.errors import CopsenseError
from copsense.maps import Axis, Grid, Sample, chunks
from copsense.maps.chunks import ChunkEvaluator
from copsense.maps.heights import height_advice
from copsense.maps.leftovers import _prefix
from copsense.maps.map_plan import MapPlan


def _grid_of(ranges):
    return Grid(tuple(Axis(n, *r, 1 if r[0] == r[1] else 9) for n, r in ranges.items()))


def _sample_of(ranges):
    return Sample(tuple(Axis(n, *r) for n, r in ranges.items()), 81)


NEAR = 2e-6  # float32 against the reference


def test_rows_are_those_of_the_reference(whole, icub, both, sample):
    dataset = copsense.load_map(whole[0])
    postures = PostureChart(icub, sample.names).solve(sample.values(0, len(sample)))
    rows = np.flatnonzero(postures.converged)[:: len(sample) // 12]
    assert len(rows) > 5
    for row in rows:
        here = icub.at(postures.configurations[row])
        for j, criterion in enumerate(both):
            expected = copsense.cop_sensitivity(here, criterion)
            found = dataset.isel(posture=row, criterion=j)
            gains = np.linalg.norm(expected.com_gain, 2, axis=(1, 2))
            for name, value in {
                "cop": expected.cop,
                "com_gain": expected.com_gain,
                "com_travel": expected.com_travel,
                "unloading_travel": expected.unloading_travel,
                "least_com_travel": min(expected.com_travel.min(), expected.unloading_travel.min()),
                "largest_com_gain": gains.max(),
                "com": here.com,
            }.items():
                assert np.allclose(found[name].values, value, rtol=NEAR, atol=NEAR), name
            assert np.array_equal(found["tipping_edge"].values, expected.tipping_edge)


def test_a_stored_number_is_the_computed_one_rounded(whole, icub, both, sample):
    dataset = copsense.load_map(whole[0])
    chart = PostureChart(icub, sample.names, over=sample.ends)
    postures = chart.solve(sample.values(0, len(sample)))
    there = np.flatnonzero(postures.converged)
    result = BatchKernel(icub, both).evaluate(postures.configurations[there])
    computed = {"cop": result.cops, "com": result.com, "load_share": result.load_share}
    for name in ("com_gain", "com_travel", "unloading_travel", "margin"):
        computed[name] = getattr(result, name)
    for name, values in computed.items():
        stored = dataset[name].values[there]
        assert (np.abs(stored - values) <= 2.0**-24 * np.abs(values)).all(), name
        assert (stored != values).any(), name


def test_coordinates_are_where_the_postures_are(whole):
    dataset = copsense.load_map(whole[0])
    there = (dataset["status"] == 0).all("criterion").values
    assert np.allclose(dataset["com_y"].values[there], dataset["com"].values[there, 1], atol=1e-7)
    assert np.allclose(dataset["com_z"].values[there], dataset["com"].values[there, 2], atol=1e-7)


def test_a_posture_out_of_reach_is_a_row_with_its_reason(whole):
    dataset = copsense.load_map(whole[0])
    lost = (dataset["status"] == 1).values
    assert 0 < lost.sum() < lost.size
    assert (dataset["reason"].values != "")[lost].all()
    assert (dataset["reason"].values == "")[~lost].all()
    assert np.isnan(dataset["com_travel"].values[lost]).all()
    assert np.isfinite(dataset["com_travel"].values[~lost]).all()
    assert (dataset["tipping_edge"].values[lost] == -1).all()
    assert (dataset["tipping_edge"].values[~lost] >= 0).all()


def test_xarray_opens_the_store_by_itself(whole):
    dataset = xr.open_zarr(whole[0], chunks=None)
    assert set(dataset.coords) >= {"com_y", "com_z", "roll", "criterion", "contact"}
    assert dataset["com_travel"].dims == ("posture", "criterion", "contact")
    assert dataset["com_z"].attrs["units"] == "m"
    assert dataset["roll"].attrs["units"] == "rad"
    assert all("units" in v.attrs for v in dataset.values() if v.dtype.kind == "f")
    one = dataset["least_com_travel"].sel(criterion="minimum-torque")
    assert one.dtype == np.float32
    assert bool(dataset["done"].all())


def test_a_grid_unstacks_into_its_axes(icub, both, grid, tmp_path):
    copsense.map_postures(icub, grid, both, tmp_path / "m.zarr", chunk=50)
    dataset = copsense.load_map(tmp_path / "m.zarr")
    cube = dataset["com"].set_index(posture=list(grid.names)).unstack("posture")
    assert [cube.sizes[name] for name in grid.names] == list(grid.shape)


def test_a_chunk_evaluated_in_pieces_is_the_same_bits(icub, both, sample, monkeypatch):
    evaluator = ChunkEvaluator(MapPlan(icub, both, sample))
    whole = evaluator.evaluate(0)
    monkeypatch.setattr(chunks, "_PIECE", 23)
    pieces = evaluator.evaluate(0)
    assert whole.keys() == pieces.keys()
    for name, rows in whole.items():
        assert np.array_equal(rows, pieces[name], equal_nan=rows.dtype.kind == "f"), name


def test_large_maps_have_large_chunks(icub, both):
    sizes = [
        MapPlan(icub, both, Sample((Axis("com_y", -0.01, 0.01),), count)).size
        for count in (1, 262143, 262144)
    ]
    assert sizes == [4096, 4096, 16384]
    assert MapPlan(icub, both, Sample((Axis("com_y", -0.01, 0.01),), 262144), chunk=7).size == 7


def test_a_map_resumed_or_cut_among_threads_is_the_same_bits(
    whole, icub, both, sample, tmp_path, same
):
    path, seen = tmp_path / "m.zarr", []

    class StopError(Exception):
        pass

    def stop(count):
        seen.append(count)
        if len(seen) == 3:
            raise StopError

    with pytest.raises(StopError):
        copsense.map_postures(icub, sample, both, path, chunk=32, progress=stop)
    partial = copsense.maps.map_summary(path)
    assert (partial.chunks_done, partial.complete) == (3, False)
    resumed = []
    found = copsense.map_postures(
        icub, sample, both, path, chunk=32, threads=3, progress=resumed.append
    )
    assert resumed[0] == 3 * 32
    assert sum(resumed) == len(sample)
    assert found.complete
    assert same(path, whole[0])
    assert vars(found) | {"path": ""} == vars(whole[1]) | {"path": ""}


def test_a_chunk_without_its_mark_is_evaluated_again(icub, both, sample, whole, tmp_path, same):
    import zarr

    path = tmp_path / "m.zarr"
    shutil.copytree(whole[0], path)
    group = zarr.open_group(path, mode="r+")
    group["done"][4], group["com_travel"][4 * 32 : 4 * 32 + 7] = 0, 123.0
    copsense.map_postures(icub, sample, both, path, chunk=32)
    assert same(path, whole[0])


def test_what_killed_processes_left_is_removed_unless_another_holds_it(
    icub, both, sample, whole, tmp_path
):
    fcntl = pytest.importorskip("fcntl")
    path = tmp_path / "m.zarr"
    folders = [tmp_path / f"{_prefix(path)}{n}.zarr" for n in ("dead", "live")]
    for folder in folders:
        (folder / "parts").mkdir(parents=True)
    live = os.open(folders[1], os.O_RDONLY)
    fcntl.flock(live, fcntl.LOCK_SH)
    shutil.copytree(whole[0], path)
    finished = {p.relative_to(path) for p in path.rglob("*")}
    left = path / "parts" / "worst" / "c" / "4" / "0" / f"0.{'0f' * 16}.partial"
    left.parent.mkdir(parents=True, exist_ok=True)
    left.write_bytes(b"half")
    other = os.open(path, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_SH)
    copsense.map_postures(icub, sample, both, path, chunk=32)
    assert left.exists()
    os.close(other)
    copsense.map_postures(icub, sample, both, path, chunk=32)
    assert {p.relative_to(path) for p in path.rglob("*")} == finished
    assert [folder.exists() for folder in folders] == [False, True]
    os.close(live)


def test_values_do_not_depend_on_the_chunks(whole, icub, both, sample, tmp_path):
    found = copsense.map_postures(icub, sample, both, tmp_path / "m.zarr", chunk=101)
    one, other = copsense.load_map(whole[0]), copsense.load_map(tmp_path / "m.zarr")
    for name in ("least_com_travel", "com_gain", "cop", "status", "com_y"):
        assert one[name].values.tobytes() == other[name].values.tobytes(), name
    assert found.criteria == whole[1].criteria


def test_limits_tell_the_feasible_from_the_infeasible(icub, both, tmp_path):
    z = float(icub.com[2]) - 0.02
    grid = Grid((Axis("com_z", z, z, 1), Axis("com_x", -0.08, 0.12, 9)))
    limits = copsense.Limits(friction=0.3, cop_margin=0.02)
    path = tmp_path / "m.zarr"
    summary = copsense.map_postures(icub, grid, both, path, limits, configurations=True)
    dataset = copsense.load_map(path)
    statuses, states = dataset["status"].values, dataset["state_within"].values
    assert dataset["state_within"].attrs["flag_meanings"] == " ".join([*LIMIT_STATES, "pending"])
    assert ((states == 2) == (statuses == 3)).all()
    assert ((states == 4) == (statuses == 1)).all()
    assert (np.isnan(dataset["cop_within"].values).any((-1, -2)) == (states > 1)).all()
    assert (np.isnan(dataset["change_travel"].values) == (states > 1)).all()
    assert ((dataset["change_limit"].values == -1) == (states > 1)).all()
    index = xr.open_zarr(path)["change_limit"].load()  # as docs/maps.md has it
    names = dataset["limit_name"].isel(limit_name=index).where(index >= 0, "")
    for j, criterion in enumerate(both):
        counts = dict(zip(LIMIT_STATES, np.bincount(states[:, j], minlength=5), strict=True))
        assert summary.criteria[criterion.name].counts_within == counts
    assert (statuses == 0).any()
    assert (statuses == 3).any()
    for row, q in enumerate(dataset["configuration"].values):
        for j, criterion in enumerate(both):
            if statuses[row, j] == 1:
                continue
            here = icub.at(q)
            own = copsense.solve_equilibrium(here, criterion)
            nearest = min(
                m.value for m in copsense.margins.limit_margins(own, limits) if m.kind == "cop"
            )
            found = dataset["limit_margin"].sel(limit="cop").values[row, j]
            assert found == pytest.approx(nearest, rel=1e-5, abs=1e-6)
            reason = dataset["reason"].values[row, j]
            if statuses[row, j] == 3:
                # Which of a sole's edges, all but in line, are in conflict hangs on the last bits.
                relaxed, _, conflict = reason.partition(" In conflict: ")
                assert all(f"{name}: CoP at edge" in conflict for name in icub.contact_names)
                with pytest.raises(copsense.CopsenseError, match=re.escape(relaxed)):
                    copsense.solve_equilibrium(here, criterion, limits)
            else:
                assert reason == ""
                within = copsense.cop_sensitivity(here, criterion, limits)
                presses = len(within.equilibrium.pressing)
                assert dataset["active_limits"].values[row, j] == presses
                assert states[row, j] == (presses > 0)
                change = within.nearest_active_set_change()
                assert names.values[row, j] == change.name
                stored = dataset["change_travel"].values[row, j]
                assert stored == pytest.approx(change.travel, rel=1e-6)
                for column, value in (
                    ("cop_within", within.cop),
                    ("com_gain_within", within.com_gain),
                ):
                    stored = dataset[column].values[row, j]
                    np.testing.assert_allclose(stored, value, rtol=1e-5, atol=1e-6)


def test_a_contact_that_limits_leave_without_load_is_said_so(icub, both, tmp_path):
    # A hand that minimum torque has pull on a wall beside it: within friction, it lets go.
    stance = with_hand(icub, "l_hand", (-1, 0.3, 0.05))
    z = float(stance.com[2]) - 0.01
    grid = Grid((Axis("com_y", -0.02, 0.02, 3), Axis("com_z", z, z, 1)))
    limits = copsense.Limits(friction=0.3, torque=20.0)
    path = tmp_path / "m.zarr"
    summary = copsense.map_postures(stance, grid, both[1:], path, limits, configurations=True)
    dataset = copsense.load_map(path).isel(criterion=0)
    assert (dataset["status"].values == 0).all()
    unloaded = dataset["state_within"].values == 3
    assert unloaded.tolist() == [False, False, True]
    assert summary.criteria[both[1].name].counts_within["unloaded"] == 1
    assert (np.isnan(dataset["cop_within"].values).all((-1, -2)) == unloaded).all()
    for row, q in enumerate(dataset["configuration"].values):
        found = copsense.solve_equilibrium(stance.at(q), both[1], limits)
        assert found.unloaded == (("hand",) if unloaded[row] else ())
        assert dataset["active_limits"].values[row] == len(found.pressing)
        assert np.isnan(dataset["change_travel"].values[row]) == unloaded[row]
        assert (dataset["change_limit"].values[row] == -1) == unloaded[row]


def test_feet_and_joints_are_coordinates_too(icub, both, tmp_path):
    names = ("l_sole:x", "torso_yaw")
    here = dict(zip(names, PostureChart(icub, names).values, strict=True))
    grid = Grid(tuple(Axis(n, v - 0.01, v + 0.01, 3) for n, v in here.items()))
    found = copsense.map_postures(icub, grid, both, tmp_path / "m.zarr")
    assert found.coordinates == names
    assert found.units == ("m", "rad")
    assert "l_sole_x" in copsense.load_map(tmp_path / "m.zarr").coords
    assert found.criteria["minimum-torque"].counts["evaluated"] == 9


def test_what_does_not_fit_is_rejected_and_leaves_nothing(icub, both, sample, tmp_path):
    path = tmp_path / "m.zarr"
    bad = Grid((Axis("com_q", 0.0, 1.0, 2),))
    for arguments, word in [
        ((icub, bad, both, path), "com_q"),
        ((icub, sample, [], path), "at least one"),
        ((icub, sample, both, tmp_path / "m.nc"), "suffix"),
        ((icub, sample, both, tmp_path / "no" / "m.zarr"), "no folder"),
        ((icub, sample, both, path, copsense.Limits(torque={"elbow": 1.0})), "elbow"),
    ]:
        with pytest.raises(CopsenseError, match=word):
            copsense.map_postures(*arguments)
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("make", [_grid_of, _sample_of])
def test_lost_for_its_height_a_map_has_a_note_on_the_height_to_map_over(icub, make):
    wide = {"com_x": (-0.06, 0.06), "com_y": (-0.06, 0.06)}
    advice = height_advice(icub, make(wide))
    low, high = map(float, re.search(r"com_z=([\d.]+):([\d.]+)", advice).groups())
    followed = make(wide | {"com_z": (low, high)})
    values = [make(wide).values(0, len(make(wide))), followed.values(0, len(followed))]
    charts = PostureChart(icub, list(wide)), PostureChart(icub, followed.names)
    shares = [c.solve(v).converged.mean() for c, v in zip(charts, values, strict=True)]
    assert shares[0] < 0.5 < 0.9 < shares[1]
    assert not height_advice(icub, followed)
    assert not height_advice(icub, make({"com_y": (-0.01, 0.01)}))  # few are lost
    assert not height_advice(icub, make({"com_y": (5.0, 6.0)}))  # no height helps


def test_the_summary_names_what_happens_first_to_which_contact(whole):
    dataset = copsense.load_map(whole[0])
    for name, criterion in whole[1].criteria.items():
        for worst in criterion.worst_travel:
            here = dataset.sel(criterion=name).isel(posture=worst.posture)
            k = list(here["contact"].values).index(worst.contact)
            assert here["com_travel"].values[k] == np.float32(worst.value)
            assert here["tipping_edge"].values[k] == worst.tipping_edge >= 0
            assert worst.event == ("tips" if here["margin"].values[k] >= 0 else "off its sole")
        others = {(w.contact, w.tipping_edge, w.event) for w in criterion.worst_gain}
        assert others == {("", -1, "")}


def test_points_unload_or_pull_already(stance_of, both, tmp_path):
    stance, grid = (
        stance_of("solo12"),
        Grid((Axis("com_z", 0.17, 0.17, 1), Axis("com_y", 0.02, 0.16, 2))),
    )
    summary = copsense.map_postures(stance, grid, both, tmp_path / "m.zarr", configurations=True)
    dataset = copsense.load_map(tmp_path / "m.zarr")
    for j, criterion in enumerate(both):
        row = summary.criteria[criterion.name]
        for worst, event in zip(row.worst_travel, ("pulls", "unloads"), strict=True):
            here = stance.at(dataset["configuration"].values[worst.posture])
            expected = copsense.cop_sensitivity(here, criterion).unloading_travel
            assert worst.event == event
            assert worst.value == pytest.approx(expected.min(), rel=NEAR)
            k = stance.contact_names.index(worst.contact)
            assert expected[k] == pytest.approx(expected.min(), rel=1e-6)
            assert worst.tipping_edge == -1
        assert row.without_travel == 1
        assert np.isposinf(dataset["com_travel"].values[:, j]).all()


def test_the_summary_names_the_first_that_failed_and_why(whole):
    dataset = copsense.load_map(whole[0])
    row = int(np.flatnonzero(dataset["status"].values[:, 1] == 1)[0])
    first = whole[1].criteria["minimum-torque"].failed
    assert list(first) == ["unreachable"]
    assert first["unreachable"].posture == row
    assert first["unreachable"].reason == dataset["reason"].values[row, 1]
    assert first["unreachable"].coordinates["com_z"] == dataset["com_z"].values[row]
