"""The kernel on a device: simulated, every thread in Python, by Numba's own simulator."""

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import copsense
from copsense.batch import evaluate_batch
from copsense.batch.devices import compiling
from copsense.errors import InvalidInputError, MissingExtraError, OutputError

# Under Numba's simulator, which has to be chosen before Numba is imported.
CODE = """
import json, math
import numpy as np, copsense
from copsense.batch import BatchKernel
from copsense.batch.statics import batch_kernel, device_kernel
from copsense.batch.statics.batch_result import arrays_of
from support.stances import TORQUE, WRENCH, postures, served

asked, fill_row = [], batch_kernel.fill_row
def counting(stance, q, criterion, result, row, column):
    asked.append((row, column))
    return fill_row(stance, q, criterion, result, row, column)
batch_kernel.fill_row = counting

def difference(name, criteria, limits, count, turns):
    stance = copsense.load_stance(name)
    kernel, q = BatchKernel(stance, criteria(stance), limits), postures(stance, count)
    q[0, -1] += 2 * math.pi * turns
    asked.clear()
    here, by_reference = kernel.evaluate(q), asked[:]
    asked.clear()
    there, gaps = kernel.evaluate(q, device="cuda"), {}
    for array, wanted in arrays_of(here).items():
        found = arrays_of(there)[array]
        with np.errstate(invalid="ignore"):
            same = (found == wanted) | (np.isnan(found) & np.isnan(wanted))
            gap = np.where(same, 0.0, abs(found - wanted) / (1 + abs(wanted)))
        gaps[array] = float(gap.max())
    limits = [] if limits is None else [here.limits.state.tolist(), there.limits.state.tolist()]
    assert here.reasons == there.reasons
    return {"gaps": gaps, "by_reference": [by_reference, asked[:]], "limits": limits}

def without_compiler():
    def absent(*_):
        raise RuntimeError('Failure finding "libnvvm.so.4"')
    device_kernel._clearing = {(1, 32): absent}
    stance = copsense.load_stance("solo12")
    try:
        BatchKernel(stance, [TORQUE]).evaluate([stance.q], device="cuda")
    except copsense.errors.InvalidInputError as error:
        return str(error)

print(json.dumps({
    "icub": difference("icub", served, None, 1, 0),
    "solo12": difference("solo12", lambda _: [WRENCH, TORQUE], None, 2, 20_000),
    "limited": difference("solo12", lambda _: [TORQUE], copsense.Limits(friction=0.1), 1, 0),
    "without": without_compiler(),
}))
"""


def test_compiling_for_a_device_without_the_compiler_is_one_line(monkeypatch):
    pathfinder = pytest.importorskip("cuda.pathfinder")
    monkeypatch.syspath_prepend(Path(__file__).parents[3] / "benchmarks")
    monkeypatch.delitem(sys.modules, "postures", raising=False)
    gpu = importlib.import_module("gpu")

    def absent(name):
        raise pathfinder.DynamicLibNotFoundError(f"no {name}")

    monkeypatch.setattr(pathfinder, "load_nvidia_dynamic_lib", absent)
    monkeypatch.setattr(sys, "argv", ["gpu.py", "--compile", "9.0"])
    with pytest.raises(SystemExit, match=r'^error: CUDA.*pip install "copsense\[gpu\]"'):
        gpu.main()
    for name in ("gpu", "postures"):
        monkeypatch.delitem(sys.modules, name)


def run(code, **environment):
    here = Path(__file__).parents[2]
    paths = os.pathsep.join([str(here), *filter(None, sys.path)])
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": paths, **environment},
    )


@pytest.fixture(scope="module")
def simulated():
    pytest.importorskip("numba_cuda")  # which macOS has no wheel of
    done = run(CODE, NUMBA_ENABLE_CUDASIM="1")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_device_gives_what_the_processor_gives(simulated):
    for name in ("icub", "solo12", "limited"):
        found = simulated[name]
        for array, gap in found["gaps"].items():
            assert gap < 1e-12, (name, array)


def test_the_reference_answers_what_a_device_doubts(simulated):
    here, there = simulated["solo12"]["by_reference"]
    assert here == there == [[0, 0], [0, 1]]
    assert simulated["icub"]["by_reference"] == [[], []]


def test_the_processor_puts_a_devices_answers_within_limits(simulated):
    here, there = simulated["limited"]["limits"]
    assert here == there
    assert any(here[0])


def test_a_kernel_without_cudas_compiler_is_one_error(simulated):
    assert simulated["without"].startswith('device is "cuda", and CUDA\'s compiler (NVVM) ')


def errors_of_cuda():
    """What Numba and NVIDIA's packages raise: where, and what copsense says of it."""
    numba_errors = pytest.importorskip("numba.cuda.cudadrv.error")
    driver = pytest.importorskip("numba.cuda.cudadrv.driver")
    pathfinder = pytest.importorskip("cuda.pathfinder")
    old = "Call to cuModuleLoadDataEx results in CUDA_ERROR_UNSUPPORTED_PTX_VERSION"
    return [
        (pathfinder.DynamicLibNotFoundError('Failure finding "libnvrtc.so.12"'), "(NVRTC) is mis"),
        (numba_errors.NvvmSupportError("libNVVM is not available"), "(NVVM) is missing"),
        (ModuleNotFoundError("No module named 'cuda.core'"), "compiler is missing (No module"),
        (FileNotFoundError(2, "No such file", "libdevice.10.bc"), "(libdevice) is missing"),
        (numba_errors.CCSupportError("capability 3.5 is not supported"), "does not serve this"),
        (RuntimeError("less than the minimum supported by NVRTC 13.0"), "(NVRTC) does not serve"),
        (driver.CudaAPIError(222, old), f"does not serve this device ([222] {old})."),
        (numba_errors.NvvmError("x" * 999), "x ...)."),
    ]


def test_what_cudas_compilers_lack_is_one_error_with_the_line_that_installs_them():
    for raised, said in errors_of_cuda():
        with pytest.raises(InvalidInputError) as caught, compiling():
            raise raised
        assert caught.value.__cause__ is raised
        assert said in str(caught.value)
        assert 'pip install "copsense[gpu]"' in str(caught.value)
        assert str(caught.value).endswith('give "cpu", to evaluate on the processor.')


def test_an_error_that_is_not_of_cuda_is_left_alone():
    for raised in (ZeroDivisionError("mine"), OutputError("of copsense")):
        with pytest.raises(type(raised), match=str(raised)), compiling():
            raise raised


def test_a_device_that_is_not_there_is_one_error(monkeypatch):
    stance = copsense.load_stance("solo12")
    with pytest.raises(InvalidInputError, match="Give one of cpu, cuda"):
        evaluate_batch(stance, [stance.q], [copsense.minimum_torque()], device="gpu")
    monkeypatch.setitem(sys.modules, "numba_cuda", None)
    with pytest.raises(MissingExtraError, match=r"copsense\[gpu\]"):
        evaluate_batch(stance, [stance.q], [copsense.minimum_torque()], device="cuda")


def test_a_machine_without_a_device_says_so():
    pytest.importorskip("numba_cuda")
    code = (
        "import copsense; from copsense.batch import evaluate_batch as e\n"
        "s = copsense.load_stance('solo12')\n"
        "e(s, [s.q], [copsense.minimum_torque()], device='cuda')"
    )
    done = run(code, CUDA_VISIBLE_DEVICES="", NUMBA_ENABLE_CUDASIM="0")
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith('copsense.errors.InvalidInputError: device is "cuda", and no such')
    assert "nvidia-smi" in last
