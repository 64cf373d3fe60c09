"""Results are written whole or not at all, never over another file unasked, and read with care."""

import numpy as np
import pytest
import xarray as xr

import copsense
from copsense import labelled
from copsense.errors import InvalidInputError, OutputError
from copsense.files import check_output, load_configurations


@pytest.fixture(scope="module")
def dataset():
    stance = copsense.load_stance("four_bar")
    path = copsense.lateral_sweep(stance, -0.02, 0.02, 3)
    return copsense.sweep(path, [copsense.minimum_torque()])


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
@pytest.mark.parametrize("name", ["plain", "with space", "ünï cödé 日本", "x" * 240])
def test_any_name_of_a_file_will_do(dataset, name, suffix, tmp_path):
    path = dataset.save(tmp_path / (name + suffix))
    assert path.stat().st_size > 0
    assert [p.name for p in tmp_path.iterdir()] == [name + suffix]


@pytest.mark.parametrize(
    ("name", "error", "said"),
    [
        ("results.txt", InvalidInputError, "Choose .nc or .csv"),
        ("results", InvalidInputError, "Choose .nc or .csv"),
        ("", InvalidInputError, "Choose .nc or .csv"),
        ("absent/results.nc", OutputError, "Create it first"),
        ("file.txt/results.nc", OutputError, "Create it first"),
        ("folder.nc", OutputError, "is a folder"),
        ("x" * 300 + ".nc", OutputError, "File name too long"),
        ("nu\0l.nc", OutputError, "null character"),
    ],
)
def test_a_path_that_cannot_be_written_says_why(dataset, name, error, said, tmp_path):
    (tmp_path / "folder.nc").mkdir()
    (tmp_path / "file.txt").write_text("mine")
    with pytest.raises(error) as caught:
        dataset.save(f"{tmp_path}/{name}" if name else "")
    assert said in str(caught.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file.txt", "folder.nc"]


def test_a_folder_that_rejects_files_says_so_before_the_work(monkeypatch, tmp_path):
    def reject(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.mkstemp", reject)
    with pytest.raises(OutputError, match=r"Permission denied\. Choose another path"):
        check_output(tmp_path / "results.nc", suffixes=(".nc",), overwrite=False)


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_a_file_that_exists_is_kept_unless_told_otherwise(dataset, suffix, tmp_path):
    path = tmp_path / f"results{suffix}"
    path.write_text("old")
    with pytest.raises(OutputError, match=r"exists already\. .*--force"):
        dataset.save(path)
    assert path.read_text() == "old"
    dataset.save(path, overwrite=True)
    assert path.stat().st_size > 3


@pytest.mark.parametrize("failure", [OSError(28, "No space left"), RuntimeError("HDF error")])
def test_a_failure_in_the_middle_of_writing_leaves_the_old_file(
    dataset, failure, monkeypatch, tmp_path
):
    path = tmp_path / "results.nc"
    path.write_text("old")

    def half(data, temporary):
        temporary.write_bytes(b"half a fi")
        raise failure

    monkeypatch.setattr(labelled, "write_netcdf", half)
    with pytest.raises(OutputError, match=r"could not be written.*Free some space"):
        dataset.save(path, overwrite=True)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["results.nc"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ZeroDivisionError])
def test_an_interruption_of_writing_leaves_nothing_behind(dataset, stop, monkeypatch, tmp_path):
    def half(data, temporary):
        temporary.write_bytes(b"half a fi")
        raise stop

    monkeypatch.setattr(labelled, "write_netcdf", half)
    with pytest.raises(stop):
        dataset.save(tmp_path / "results.nc")
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_a_sweep_is_rejected():
    with pytest.raises(InvalidInputError, match=r"not a sweep .*: it lacks com, .*sweep ret"):
        copsense.Sweep(xr.Dataset({"a": 1}))


def test_what_is_written_is_read_back(dataset, tmp_path):
    back = copsense.Sweep.load(dataset.save(tmp_path / "results.nc"))
    assert back == dataset
    for name in dataset:
        np.testing.assert_array_equal(back[name].values, dataset[name].values, err_msg=name)


def test_a_file_of_results_that_is_absent_or_a_folder_says_how_to_make_one(tmp_path):
    for path in (tmp_path / "absent.nc", tmp_path, "x" * 5000):
        with pytest.raises(InvalidInputError, match=r"no file at .*copsense sweep"):
            copsense.Sweep.load(path)


def test_a_file_that_is_no_netcdf_says_so(dataset, tmp_path):
    whole = dataset.save(tmp_path / "whole.nc").read_bytes()
    for content in (b"", b"posture,com_y\n0,0\n", whole[: len(whole) // 2]):
        path = tmp_path / "broken.nc"
        path.write_bytes(content)
        with pytest.raises(InvalidInputError, match="not a netCDF file that can be read"):
            copsense.Sweep.load(path)


def test_a_netcdf_of_something_else_says_what_it_lacks(tmp_path):
    foreign = xr.Dataset({name: ("x", [1.0]) for name in ("cop", "wrench", "reason")})
    foreign.to_netcdf(tmp_path / "foreign.nc")
    with pytest.raises(InvalidInputError, match=r"not a sweep of copsense: it lacks .*torque"):
        copsense.Sweep.load(tmp_path / "foreign.nc")


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("empty.csv", b"", "holds no table"),
        ("words.csv", b"a,b\n1,2\n", "without a heading"),
        ("ragged.csv", b"1,2,3\n4,5\n", "nq numbers a row"),
        ("nan.csv", b"1,nan\n", "not finite at index 0, 1"),
        ("broken.npy", b"no array", "not a table of configurations"),
        ("absent.csv", None, "no file of configurations"),
    ],
)
def test_configurations_that_are_no_table_of_numbers_say_so(name, content, said, tmp_path):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InvalidInputError) as caught:
        load_configurations(tmp_path / name)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "array",
    [np.ones(3), np.ones((0, 3)), np.array([["a"]]), np.ones((1, 2), complex), np.array([[None]])],
    ids=["flat", "empty", "words", "complex", "objects"],
)
def test_arrays_that_are_no_configurations_say_so(array, tmp_path):
    np.save(tmp_path / "q.npy", array)
    with pytest.raises(InvalidInputError, match=r"q\.npy"):
        load_configurations(tmp_path / "q.npy")


def test_the_table_keeps_the_coordinate_of_a_row_that_failed(icub, tmp_path):
    dataset = copsense.sweep(copsense.lateral_sweep(icub, 0.0, 5.0, 2), [copsense.minimum_torque()])
    table = dataset.to_pandas()
    assert sorted(set(table["com_y"])) == pytest.approx([0.0, 5.0])
    assert table.loc[table["com_y"] == 5.0, "reason"].str.contains("no posture").all()
