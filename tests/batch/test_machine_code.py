"""Machine code kept on disk is of use only while what it was made of stays the same."""

import ast
from pathlib import Path

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
