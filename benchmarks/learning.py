"""How many postures a second the functions for PyTorch and JAX evaluate, gradients included.

The iCub on two feet over its CoM's coordinates: ``python benchmarks/learning.py``. What is not
installed is left out. Nothing is written; run it on an idle machine.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable

import numpy as np

import copsense
from copsense.learning import CopMap

NAMES = ("com_x", "com_y", "com_z")
WIDTH = np.array([0.01, 0.02, 0.01])  # m, to either side of 2 cm under the stance
CRITERIA = (copsense.minimum_wrench(1.0), copsense.minimum_torque())


def rate(run: Callable[[], object], count: int, repeat: int = 3) -> float:
    """Postures a second of the fastest of some runs."""
    run()
    best = np.inf
    for _ in range(repeat):
        start = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - start)
    return count / best


def with_torch(cops: CopMap, x: np.ndarray) -> dict[str, Callable[[], object]]:
    """CoPs, and travels, and their gradients."""
    import torch

    from copsense.torch import CopFunction

    f = CopFunction(cops.stance, cops.criterion, NAMES, threads=cops.threads)
    rows = torch.from_numpy(x).requires_grad_()
    few = torch.from_numpy(x[: len(x) // 20].copy()).requires_grad_()

    def pull(of: Callable[[torch.Tensor], torch.Tensor], at: torch.Tensor) -> None:
        at.grad = None
        of(at).sum().backward()

    return {
        "CoPs": lambda: f(rows.detach()),
        "CoPs and gradients": lambda: pull(f, rows),
        "CoPs, margins, travels": lambda: f.values(rows.detach()),
        "travels and gradients": lambda: pull(lambda at: f.values(at).travel, few),
    }


def with_jax(cops: CopMap, x: np.ndarray) -> dict[str, Callable[[], object]]:
    """The same, compiled by JAX."""
    import jax

    jax.config.update("jax_enable_x64", True)
    from copsense.jax import CopFunction

    f = CopFunction(cops.stance, cops.criterion, NAMES, threads=cops.threads)
    rows, few = jax.numpy.asarray(x), jax.numpy.asarray(x[: len(x) // 20])
    plain, values = jax.jit(f), jax.jit(f.values)
    pull = jax.jit(jax.value_and_grad(lambda at: f(at).sum()))
    pull_travel = jax.jit(jax.value_and_grad(lambda at: f.values(at).travel.sum()))
    wait = jax.block_until_ready
    return {
        "CoPs": lambda: wait(plain(rows)),
        "CoPs and gradients": lambda: wait(pull(rows)),
        "CoPs, margins, travels": lambda: wait(values(rows)),
        "travels and gradients": lambda: wait(pull_travel(few)),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100_000, help="postures")
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    stance = copsense.load_stance("icub")
    draw = np.random.default_rng(0).uniform(-1, 1, (options.count, 3))
    for criterion in CRITERIA:
        cops = CopMap(stance, criterion, NAMES, threads=options.threads)
        x = cops.start - [0.0, 0.0, 0.02] + draw * WIDTH
        for package, make in (("torch", with_torch), ("jax", with_jax)):
            if importlib.util.find_spec(package) is None:
                print(f"{package} is not installed")
                continue
            for what, run in make(cops, x).items():
                count = options.count // 20 if what.startswith("travels") else options.count
                print(
                    f"{criterion.name:16} {package:6} {what:24} {rate(run, count):>10,.0f} "
                    "postures/s",
                    flush=True,
                )


if __name__ == "__main__":
    main()
