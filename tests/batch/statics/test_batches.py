"""How batches are called: threads, memory to reuse, one posture at a time, bad input."""

import copy
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from support.stances import postures, served

import copsense
from copsense.arrays import whole_number
from copsense.batch import BatchKernel, evaluate_batch
from copsense.batch.blocks import fill_blocks
from copsense.batch.statics.batch_result import array_names

TORQUE = copsense.minimum_torque()


@pytest.fixture(scope="module")
def many(case):
    """Two thousand configurations of a few postures, in an order of no period of eight."""
    q = postures(case("icub"), 7)
    return q[np.random.default_rng(1).integers(0, 7, 2003)]


def arrays(result):
    return {name: getattr(result, name).copy() for name in array_names()}


def test_threads_and_neighbours_change_no_bit(case, many):
    kernel = BatchKernel(case("icub"), served(case("icub")))
    one = arrays(kernel.evaluate(many))
    three = arrays(kernel.evaluate(many, threads=3))
    shifted = arrays(kernel.evaluate(many[3:]))
    for name in array_names():
        assert np.array_equal(one[name], three[name])
        assert np.array_equal(one[name][3:], shifted[name])


def test_results_are_written_into_out(case, many):
    kernel = BatchKernel(case("icub"), [TORQUE])
    out = kernel.empty(100)
    first = kernel.evaluate(many[:100], out=out)
    assert first is out
    before = first.gradient.copy()
    kernel.evaluate(many[100:200], out=out)
    assert not np.array_equal(out.gradient, before)
    assert np.array_equal(kernel.evaluate(many[:100]).gradient, before)
    assert first.nbytes == sum(a.nbytes for a in arrays(first).values())


def test_one_posture_is_a_batch_of_one(case, many):
    kernel = BatchKernel(case("icub"), served(case("icub")))
    batch = arrays(kernel.evaluate(many[:4]))
    for i in range(4):
        one = kernel.one(many[i])
        for name in array_names():
            np.testing.assert_allclose(getattr(one, name)[0], batch[name][i], rtol=1e-9, atol=1e-11)
    assert kernel.one(many[0]).gradient is kernel.one(many[1]).gradient
    assert len(one) == 1


def test_out_holds_the_reasons_of_its_rows_alone(case):
    stance = case("talos on slopes")
    kernel, q = BatchKernel(stance, [TORQUE], gains=False), postures(stance, 3)
    off = q.copy()
    off[1, 2] += 1e-5  # no longer on its planes
    out = kernel.empty(3)
    assert list(kernel.evaluate(off, out=out).reasons) == list(out.reasons) == [(1, 0)]
    kernel.evaluate(q, out=out)
    assert not out.reasons


def test_a_kernel_can_be_copied_after_use_and_compiles_nothing_again(case, many):
    from copsense.batch.statics.kernel import evaluate_postures

    kernel = BatchKernel(case("icub"), [TORQUE])
    expected = kernel.evaluate(many[:9]).gradient
    kernel.one(many[0])
    known = len(evaluate_postures.signatures)
    for other in (pickle.loads(pickle.dumps(kernel)), copy.deepcopy(kernel)):
        assert np.array_equal(other.evaluate(many[:9]).gradient, expected)
        assert np.array_equal(other.one(many[0]).com, kernel.one(many[0]).com)
    assert len(evaluate_postures.signatures) == known


def test_there_are_no_more_threads_than_blocks():
    made, rows = [], []

    def filler():
        made.append(len(made))
        return lambda start, stop: rows.extend(range(start, stop))

    fill_blocks(filler, 25, 10, threads=5000)
    assert len(made) == 3
    assert sorted(rows) == list(range(25))


@pytest.mark.parametrize(
    "change",
    [
        lambda q: q.astype(object),
        lambda q: q.astype(">f8"),
        lambda q: q.tolist(),
        np.asfortranarray,
        lambda q: np.repeat(q, 2, axis=0)[::2],
        lambda q: np.frombuffer(b"1" + q.tobytes(), offset=1).reshape(q.shape),
    ],
)
def test_numbers_may_lie_as_they_like_and_compile_once(case, many, change):
    from copsense.batch.statics.kernel import evaluate_postures

    kernel = BatchKernel(case("icub"), [TORQUE])
    expected, known = kernel.evaluate(many[:11]).gradient, len(evaluate_postures.signatures)
    assert np.array_equal(kernel.evaluate(change(many[:11])).gradient, expected)
    assert len(evaluate_postures.signatures) == known


def test_a_kernel_says_whether_it_is_compiled(case, many, monkeypatch):
    kernel = BatchKernel(case("icub"), [TORQUE])
    kernel.evaluate(many[:1])
    assert kernel.compiled
    assert BatchKernel(case("icub"), [TORQUE]).compiled  # from disk, or of this process
    monkeypatch.setattr("copsense.batch.compiler.is_compiled", lambda _: False)
    assert not BatchKernel(case("icub"), [TORQUE]).compiled


def test_results_are_printed_in_one_line(case, many):
    found = evaluate_batch(case("icub"), many[:3], [TORQUE])
    assert repr(found) == (
        "BatchResult(3 postures; criteria minimum-torque; contacts l_sole, r_sole)"
    )
    failed = replace(found, reasons={(1, 0): "no load"})
    assert "3 postures, 1 failed;" in repr(failed)
    assert "(1 posture;" in repr(evaluate_batch(case("icub"), many[:1], [TORQUE]))


def test_no_posture_is_an_empty_batch(case):
    found = evaluate_batch(case("icub"), np.zeros((0, 30)), [TORQUE])
    assert len(found) == 0
    assert found.gradient.shape == (0, 1, 2, 2, 29)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda q: q[:, :-1], "shape"),
        (lambda q: q[0], "shape"),
        (lambda q: np.where(np.arange(30) == 9, np.nan, q), "not finite"),
        (lambda q: q * 1.01, "unit length"),
        (lambda q: "posture", "not an array"),
        (lambda q: q + 0j, "not an array"),
        (lambda q: np.where(np.arange(3)[:, None] == 1, q * 1.01, q), "row 1: .*unit length"),
    ],
)
def test_bad_configurations_are_rejected(case, many, change, message):
    with pytest.raises(copsense.CopsenseError, match=message):
        evaluate_batch(case("icub"), change(many[:3]), [TORQUE])


@pytest.mark.parametrize("change", [lambda q: q[:-1], lambda q: q * np.nan, lambda q: q * 1.01])
def test_a_bad_single_configuration_is_rejected(case, many, change):
    kernel = BatchKernel(case("icub"), [TORQUE])
    with pytest.raises(copsense.CopsenseError, match="configuration"):
        kernel.one(change(many[0]))


def test_bad_requests_are_rejected(case, many):
    stance, q = case("icub"), many[:3]
    with pytest.raises(copsense.CopsenseError, match="distinct names"):
        evaluate_batch(stance, q, [TORQUE, TORQUE])
    with pytest.raises(copsense.CopsenseError, match="distinct names"):
        evaluate_batch(stance, q, [])
    for threads in (0, -1):
        with pytest.raises(copsense.CopsenseError, match="threads is"):
            evaluate_batch(stance, q, [TORQUE], threads=threads)
    kernel = BatchKernel(stance, [TORQUE])
    with pytest.raises(copsense.CopsenseError, match="shape"):
        kernel.evaluate(q, out=kernel.empty(4))
    made = kernel.empty(3)
    with pytest.raises(copsense.CopsenseError, match=r"out\.com is float32"):
        kernel.evaluate(q, out=replace(made, com=made.com.astype(np.float32)))
    with pytest.raises(copsense.CopsenseError, match=r"out\.tipping_edge is int32.*needs int64"):
        kernel.evaluate(q, out=replace(made, tipping_edge=made.tipping_edge.astype(np.int32)))
    with pytest.raises(copsense.CopsenseError, match="number of postures is -1"):
        kernel.empty(-1)
    with pytest.raises(copsense.CopsenseError, match="criteria"):
        kernel.evaluate(q, out=BatchKernel(stance, [TORQUE.named("other")]).empty(3))


@pytest.mark.parametrize("value", [0, -1, 1.5, None, "2", np.nan, np.inf, np.arange(2), 1j])
def test_what_is_not_a_whole_number_is_rejected(value):
    with pytest.raises(copsense.CopsenseError, match=r"threads is .* whole number from 1"):
        whole_number(value, "threads")
    assert whole_number(np.int64(3), "threads") == whole_number(3.0, "threads") == 3


def test_importing_copsense_does_not_import_numba():
    code = "import sys, copsense, copsense.batch; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
