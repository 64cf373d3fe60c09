"""A short run of benchmarks/mutations.py: broken files end in an error of copsense's own."""

import importlib.util
from pathlib import Path

import pytest

PATH = Path(__file__).parents[1] / "benchmarks" / "mutations.py"


@pytest.fixture(scope="module")
def mutations():
    spec = importlib.util.spec_from_file_location("mutations", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("kind", "count"), [("urdf", 120), ("mjcf", 90), ("stance", 60), ("options", 12)]
)
def test_broken_input_is_rejected_in_words_or_read_rightly(mutations, kind, count):
    counts, bad = mutations.run(kind, count, seed=1)
    assert not bad
    assert counts["accepted"] + counts["rejected"] == count
    assert counts["rejected"] > count / 3


def test_what_is_not_broken_is_accepted(mutations, tmp_path):
    for kind, text in (("urdf", mutations.urdf()), ("mjcf", mutations.mjcf())):
        assert mutations.cases(kind)[1](text, tmp_path) == ""
    (tmp_path / "biped.urdf").write_text(mutations.urdf())
    assert mutations.cases("stance")[1](mutations.stance_file(), tmp_path) == ""
