"""The documentation as `make docs` has built it; tests skip without it, or after a change."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BUILT = ROOT / "build" / "docs"
WRITTEN = (*(ROOT / "docs").glob("*.*"), *(ROOT / "docs" / "tutorials").glob("*.md"))


@pytest.fixture(scope="session")
def built():
    index = BUILT / "searchindex.js"
    if not index.is_file():
        pytest.skip("the documentation is not built here: make docs")
    if max(page.stat().st_mtime for page in WRITTEN) > index.stat().st_mtime:
        pytest.skip("the documentation was built before its pages were changed: make docs")
    return BUILT
