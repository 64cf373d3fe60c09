"""The public log of a swaying iCub, where it lies: it is data of others, and never committed."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLACES = [folder / "shared" / "data" for folder in (ROOT, *ROOT.parents[:2])]


def public_log():
    """Paths of com-sinusoid.mat and its URDF; the test is skipped where they are not."""
    for place in PLACES:
        if (place / "com-sinusoid.mat").is_file():
            return place / "com-sinusoid.mat", place / "icub-genova04-2021.urdf"
    import pytest

    return pytest.skip("com-sinusoid.mat is not in shared/data; docs/logs.md says where to get it")
