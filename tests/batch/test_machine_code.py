"""Machine code kept on disk is of use only while what it was made of stays the same."""

import ast
import logging
from pathlib import Path
from types import SimpleNamespace

import pytest

from copsense.batch import compiler


def test_what_kernels_take_from_the_reference_is_in_their_stamp():
    taken = set()
    for file in Path(compiler.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(
                "copsense"
            ):
                continue
            if not node.module.startswith("copsense.batch"):
                taken |= {each.name for each in node.names if each.name.isupper()}
    assert taken == set(compiler.SHARED)


def _nowhere(function, cache):
    if cache:
        raise RuntimeError("no locator")
    return function


def _otherwise(function, cache):
    file = SimpleNamespace()  # a Numba whose cache knows no stamp, or has another word for it
    return SimpleNamespace(_cache=SimpleNamespace(_cache_file=file)) if cache else function


@pytest.mark.parametrize(
    ("jit", "words"), [(_nowhere, "NUMBA_CACHE_DIR"), (_otherwise, r"otherwise than copsense")]
)
def test_code_that_is_not_kept_is_said_once(jit, words, caplog):
    compiler._warn_not_kept.cache_clear()

    def decorator(cache=False):
        return lambda function: jit(function, cache)

    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            assert compiler.kept(decorator, _nowhere) is _nowhere
    assert len(caplog.records) == 1
    assert words in caplog.text
