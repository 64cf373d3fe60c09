"""``copsense reproduce`` within limits."""

from support.commands import copsense
from support.reproductions import blank_pictures


def test_a_reproduction_takes_limits_and_rejects_impossible_ones_at_once(tmp_path, monkeypatch):
    blank_pictures(monkeypatch)
    folder = tmp_path / "report"
    arguments = ("reproduce", "--static", "--postures", "21", "--output", folder, "--quiet")
    assert "In conflict" in copsense(*arguments, "--limits", "normal-force=200").error
    assert not folder.exists()
    assert copsense(*arguments, "--limits", "friction=0.2,cop-margin=0.01,torque=30").code == 0
    page = (folder / "report.html").read_text()
    assert "CoP inside the sole by 10 mm, torques of 30 N m at most" in page
    assert "--limits friction=0.2,cop-margin=0.01,torque=30" in page
