"""The peers of `com_regions.py`, in an environment of their own that copsense is no part of.

Started by that script. Reads one JSON request a line, {"tool", "problem"}, and answers with one
JSON line, {"seconds", "polygon"} or {"error"}; the problems come from a file, as matrices.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import platform
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np


def main() -> None:
    """Answer requests until standard input ends."""
    problems = {
        name: Problem(data) for name, data in json.loads(Path(sys.argv[1]).read_text()).items()
    }
    # The tools print; answers go to a copy of standard output that they do not know.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    tools, found = {}, {}
    for name, (package, load) in TOOLS.items():
        try:
            tools[name] = load()
            found[name] = f"{package} {version(package)}"
        except Exception as error:
            found[name] = f"{package}: {type(error).__name__}: {error}"
    packages = ("numpy", "scipy", "pin", "cvxopt", "pycddlib", "pypoman", "jet-leg")
    installed = [f"Python {platform.python_version()}"]
    for name in packages:
        with contextlib.suppress(PackageNotFoundError):
            installed.append(f"{name} {version(name)}")
    hello = {"tools": found, "ready": list(tools), "installed": installed}
    print(json.dumps(hello), file=answers, flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        problem = problems[request["problem"]]
        try:
            with contextlib.redirect_stdout(sys.stderr):
                run = tools[request["tool"]](problem)  # what is made once stays out of the time
                start = time.perf_counter()
                polygon = run()
                seconds = time.perf_counter() - start
            answer: dict[str, Any] = {"seconds": seconds, "polygon": np.asarray(polygon).tolist()}
        except Exception as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


class Problem:
    """Where c = E x + e may be, over A x <= b, C x = d, and the stance for those that want it."""

    def __init__(self, data: dict[str, Any]) -> None:
        """Lists to arrays."""
        for key, value in data.items():
            setattr(self, key, np.array(value) if isinstance(value, list) else value)


def load_pypoman(method: str) -> Any:
    """Its projection of a polytope, iterative (Bretl and Lall) or by double description."""
    pypoman = importlib.import_module("pypoman")

    def prepare(p: Any) -> Any:
        arguments = (p.E, p.e), (p.A, p.b), (p.C, p.d)
        options = {"init_angle": 0.3} if method == "bretl" else {}
        return lambda: pypoman.project_polytope(*arguments, method=method, **options)

    return prepare


def load_jet_leg() -> Any:
    """Its feasible region, with this robot's Jacobians and friction pyramid in place of its own."""
    dynamics = importlib.import_module("jet_leg.dynamics.computational_dynamics")
    parameters = importlib.import_module("jet_leg.maths.iterative_projection_parameters")

    class Legs:
        def __init__(self, jacobians: np.ndarray) -> None:
            self.jacobians = jacobians

        def inverse_kin(self, *_: Any) -> None:
            pass

        def get_jacobians(self) -> tuple[Any, ...]:
            return (*self.jacobians, False)

    def prepare(p: Any) -> Any:
        tool = dynamics.ComputationalDynamics("given")
        tool.constr.kin = Legs(p.jacobians)
        tool.constr.linearized_cone_halfspaces = lambda *_: (p.pyramid, np.zeros(len(p.pyramid)))
        given = parameters.IterativeProjectionParameters()
        given.setContactsPosWF(p.feet)
        given.setCoMPosWF(p.com)
        given.setContactNormals(p.normals)
        given.setActiveContacts([1, 1, 1, 1])
        given.setTotalMass(p.weight / 9.81)
        given.setNumberOfFrictionConesEdges(len(p.pyramid))
        mode = "ONLY_FRICTION"
        if p.torque is not None:
            mode = "FRICTION_AND_ACTUATION"
            given.setTorqueLims(np.full((4, 3), p.torque))
        given.setConstraintModes([mode] * 4)

        def run() -> Any:
            polygon = tool.iterative_projection_bretl(given)[0]
            if polygon is False:
                raise ValueError("no region found")
            return polygon[:-1]

        return run

    return prepare


TOOLS = {
    "pypoman, iterative projection": ("pypoman", lambda: load_pypoman("bretl")),
    "pypoman, double description": ("pypoman", lambda: load_pypoman("cdd")),
    "jet-leg": ("jet-leg", load_jet_leg),
}


if __name__ == "__main__":
    main()
