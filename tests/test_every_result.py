"""What holds of every result: it is frozen, it reads well, it can be sent to another process."""

import importlib
import importlib.util
import inspect
import pickle
import pkgutil
import re
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from support.results import all_results, parts

import copsense
from copsense.labelled import LabelledResult

LINES, LETTERS = 12, 1500
TABLE = "Analysis"  # reads as the command's table, which is as long as its criteria
# Dataclasses that no caller holds: the working memory of a loop, a kernel or a solver.
INTERNAL = (
    "copsense.batch",
    "copsense.comparison.plan_file",
    "copsense.contact_layout",
    "copsense.learning",  # arrays that are handed on to PyTorch and JAX
    "copsense.logs.channel",
    "copsense.logs.log_motion",
    "copsense.logs.matlab_tree",
    "copsense.logs.one_clock",
    "copsense.logs.selection",
    "copsense.maps.reduction",
    "copsense.mjcf",
    "copsense.optimisation.posture_program",
    "copsense.optimisation.question",
    "copsense.optimisation.solver",
    "copsense.optimisation.variables",
    "copsense.paper",
    "copsense.plots.reading",
    "copsense.plots.style",
    "copsense.quadratic",
    "copsense.robots.stance_file",  # a file that is being read
    "copsense.statics.tied_optimum",
    "copsense.statics.program",
)
IN_THE_LOOP = {"Command", "Observation", "Snapshot", "Target"}  # good until the next step
# Into arrays that may be the caller's own.
FILLED = ("batch.", "batch within limits.", "chart postures.")
HOLDERS = re.compile("ndarray|Mapping|dict|list")


@pytest.fixture(scope="module")
def results(icub):
    return all_results(icub)


@pytest.fixture(scope="module")
def everything(results):
    return [part for name, value in results.items() for part in parts(name, value)]


def test_no_part_of_a_result_can_be_written_to(everything):
    wrong = []
    for part in everything:
        value, again = part.value, part.again
        if isinstance(value, np.ndarray):
            # One that is made again at each question is the caller's own.
            shared = value is again or np.shares_memory(value, again)
            own = value.flags.writeable and value.size and not part.where.startswith(FILLED)
            if shared and own:
                wrong.append(part.where)
        elif isinstance(value, dict | list | set) and value is again:
            wrong.append(part.where)
    assert not wrong


def test_every_result_reads_in_a_few_lines(everything):
    wrong = {}
    for part in everything:
        kind = type(part.value)
        if kind.__module__.startswith("copsense.") and kind.__name__ != TABLE:
            text = repr(part.value)
            if len(text) > LETTERS or text.count("\n") >= LINES or " object at 0x" in text:
                wrong[part.where] = (len(text), text[:80])
    assert not wrong


def test_every_result_says_whose_it_is(results):
    for name in ("scan", "scan point", "lateral path", "analysis", "kernel", "chart"):
        assert "four_bar" in repr(results[name]), name
    assert "minimum-wrench on 'icub'" in repr(results["sensitivity"])
    assert "l_sole: CoP (" in repr(results["sensitivity"])
    assert " mm to " in repr(results["travel"])
    assert "rows in" in repr(results["limit margins"])


def test_every_result_can_be_pickled(results):
    for name, value in results.items():
        again = pickle.loads(pickle.dumps(value))
        assert type(again) is type(value), name
        if not isinstance(value, LabelledResult):
            assert repr(again) == repr(value), name
        if is_dataclass(value):
            for field in fields(value):
                one, other = getattr(value, field.name), getattr(again, field.name)
                if isinstance(one, np.ndarray):
                    np.testing.assert_array_equal(one, other, err_msg=name)


def test_what_was_pickled_goes_on_as_it_would_have(results, icub):
    for name in ("sensitivity", "sensitivity within limits", "driven equilibrium"):
        value = results[name]
        one = value if "equilibrium" in name else value.equilibrium
        other = pickle.loads(pickle.dumps(one))
        motions = one.stance.admissible_motions
        for a, b in zip(one.derivative(motions), other.derivative(motions), strict=True):
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-9 * np.abs(a).max())
    path = pickle.loads(pickle.dumps(results["path"]))
    between = float(path.values[:2].mean())
    np.testing.assert_array_equal(path.at(between)[0].q, results["path"].at(between)[0].q)


def test_no_kind_of_result_is_forgotten(everything):
    held = {type(part.value) for part in everything}
    missing = set()
    for module in pkgutil.walk_packages(copsense.__path__, "copsense."):
        if module.name.endswith("__main__") or module.name.startswith("copsense.cli"):
            continue
        if module.name == "copsense.torch" and importlib.util.find_spec("torch") is None:
            continue
        for name, kind in vars(importlib.import_module(module.name)).items():
            if not (inspect.isclass(kind) and is_dataclass(kind)) or name.startswith("_"):
                continue
            inside = any(kind.__module__.startswith(each) for each in INTERNAL)
            holds = any(HOLDERS.search(str(field.type)) for field in fields(kind))
            public = kind.__module__ == module.name and not inside and name not in IN_THE_LOOP
            if public and holds and kind not in held:
                missing.add(f"{kind.__module__}.{name}")
    assert not missing
