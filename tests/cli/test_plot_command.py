"""``copsense plot`` draws what a sweep wrote, and nothing else."""

from support.commands import copsense

LIMITS = "normal-force=10,friction=0.33333,torsion=0.01333,torque=model"


def test_a_plot_takes_limits_the_sweep_knew_nothing_of(tmp_path):
    file, picture = tmp_path / "free.nc", tmp_path / "free.png"
    sweep = ("sweep", "icub", "--com-y", "-0.07:0.07:9", "--output", file)
    assert copsense(*sweep).code == 0
    assert copsense("plot", file).code == 0
    plain = picture.read_bytes()
    answer = copsense("plot", file, "--limits", LIMITS, "--force")
    assert answer.code == 0
    assert picture.read_bytes() != plain
    assert "non-negative" in copsense("plot", file, "--limits", "friction=-1", "--force").error


def test_a_plot_of_something_else_says_so(tmp_path):
    path = tmp_path / "notes.nc"
    path.write_text("not a sweep")
    assert "is not a netCDF file" in copsense("plot", path).error
    assert "no file at" in copsense("plot", tmp_path).error
    assert [p.name for p in tmp_path.iterdir()] == ["notes.nc"]
    (tmp_path / "made.zarr").mkdir()
    said = copsense("plot", tmp_path / "made.zarr").error
    assert "is a map, and plot draws a sweep" in said
    assert f"--output {tmp_path / 'made.zarr'} --plot" in said


def test_a_plot_never_writes_over_a_file_unasked(tmp_path):
    swept, picture = tmp_path / "swept.nc", tmp_path / "swept.png"
    assert copsense("sweep", "four_bar", "--com-y", "0:0.01:3", "--output", swept).code == 0
    picture.write_text("old")
    assert "--force" in copsense("plot", swept).error
    assert "Choose .png" in copsense("plot", swept, "--output", tmp_path / "swept.txt").error
    assert picture.read_text() == "old"
    assert copsense("plot", swept, "--force").code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
