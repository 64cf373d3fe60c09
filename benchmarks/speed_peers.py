"""The peers of `speed.py`, in an environment of their own that copsense is no part of.

Started by that script on the same core. Reads one JSON request a line, {"do": "build" | "answer" |
"time", "tool": name}, and answers with one JSON line. The problem, a URDF and configurations, comes
from a file. Both tools are given the cheapest form of the statics that we know: adam's gravity
term and contact Jacobians in the base's axes, then, with M = J_j J_j' (two 6 x 6 blocks, because
the legs share no joint),

    minimum wrench: f = J_b (J_b' J_b)^-1 G_b
    minimum torque: J_b' M^-1 J_b y = G_b - J_b' M^-1 J_j G_j,   f = M^-1 (J_j G_j + J_b y)

CoPs, their eight gradients by reverse differentiation, and the projection g - J' (J J')^-1 J g.
"""

from __future__ import annotations

import ctypes
import json
import os
import platform
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

COMPILER = ("gcc", os.environ.get("SPEED_GCC", "-O1"), "-march=native", "-shared", "-fPIC")
BATCH = 512  # postures that JAX maps over at once


def main() -> None:
    """Answer requests until standard input ends."""
    folder = Path(sys.argv[1])
    problem = json.loads((folder / "problem.json").read_text())
    problem["q"] = np.array(problem["q"])
    # The tools print; answers go to a copy of standard output that they do not know.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    tools: dict[str, Any] = {}
    for line in sys.stdin:
        request = json.loads(line)
        name = request["tool"]
        try:
            if request["do"] == "build":
                start = time.perf_counter()
                tools[name] = TOOLS[name](problem, folder)
                answer = {"seconds": time.perf_counter() - start, "versions": versions(name)}
            elif request["do"] == "answer":
                answer = {key: np.asarray(a).tolist() for key, a in tools[name].answer().items()}
            else:
                start = time.process_time()
                count = tools[name].run()
                answer = {"seconds": (time.process_time() - start) / count}
        except Exception as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


def versions(name: str) -> str:
    """What a tool ran with."""
    packages = {"casadi": ("casadi", "adam-robotics", "numpy"), "jax": ("jax", "adam-robotics")}
    found = [f"{package} {version(package)}" for package in packages[name]]
    if name == "casadi":
        said = subprocess.run([COMPILER[0], "--version"], capture_output=True, text=True)
        found.append(said.stdout.splitlines()[0] + " " + " ".join(COMPILER[1:3]))
    return ", ".join([*found, f"Python {platform.python_version()}"])


def unpacked(flat: np.ndarray, nv: int) -> dict[str, np.ndarray]:
    """Outputs in one row each, as arrays: wrenches, CoPs and gradients of both criteria."""
    n, rows = nv - 6, len(flat)
    ends = np.cumsum([2 * 12, 2 * n, 2 * 4, 2 * 4 * nv])
    wrenches, torques, cops, gradient = np.split(flat, ends[:-1], axis=1)
    return {
        "wrenches": wrenches.reshape(rows, 2, 2, 6),
        "torques": torques.reshape(rows, 2, n),
        "cops": cops.reshape(rows, 2, 2, 2),
        "gradient": gradient.reshape(rows, 2, 2, 2, nv),
    }


class CasadiTool:
    """Scalar symbols of CasADi, written as C and compiled; called row by row through ctypes."""

    def __init__(self, problem: dict[str, Any], folder: Path) -> None:
        """Write the code, compile it and load it."""
        self.nv, self.q = len(problem["joints"]) + 6, problem["q"]
        function = self._function(problem)
        print("CasADi: instructions", function.n_instructions(), file=sys.stderr)
        source, library = folder / "statics.c", folder / "statics.so"
        text = self._generate(function, folder)
        key = folder / "statics.key"
        if not library.exists() or not key.exists() or key.read_text() != text:
            start = time.perf_counter()
            subprocess.run([*COMPILER, "-o", library, source, "-lm"], check=True)
            print("CasADi: gcc", time.perf_counter() - start, "s", file=sys.stderr)
            key.write_text(text)
        self._load(ctypes.CDLL(str(library)), function)

    def _generate(self, function: Any, folder: Path) -> str:
        here = Path.cwd()
        os.chdir(folder)
        try:
            function.generate("statics.c")
        finally:
            os.chdir(here)
        return " ".join(COMPILER) + (folder / "statics.c").read_text()

    def _load(self, library: Any, function: Any) -> None:
        sizes = (ctypes.c_longlong * 4)()
        size = [ctypes.byref(sizes, 8 * i) for i in range(4)]
        library.statics_work(*size)
        self.output = np.zeros((len(self.q), function.size1_out(0)))
        self.work = np.zeros(max(1, sizes[3]))
        self.index = np.zeros(max(1, sizes[2]), dtype=np.int64)
        number = ctypes.POINTER(ctypes.c_double)
        self.arguments = (number * max(1, sizes[0]))()
        self.results = (number * max(1, sizes[1]))()
        call = library.statics
        rows = []
        for q, out in zip(self.q, self.output, strict=True):
            rows.append((q.ctypes.data_as(number), out.ctypes.data_as(number)))
        index = self.index.ctypes.data_as(ctypes.POINTER(ctypes.c_longlong))
        work = self.work.ctypes.data_as(number)
        arguments, results = self.arguments, self.results

        def run() -> int:
            for given, found in rows:
                arguments[0], results[0] = given, found
                call(arguments, results, index, work, 0)
            return len(rows)

        self.run = run

    def _function(self, problem: dict[str, Any]) -> Any:
        import casadi as ca
        from adam import Representations
        from adam.casadi import KinDynComputations

        names = problem["joints"]
        robot = KinDynComputations(
            problem["urdf"], names, gravity=np.array([*problem["gravity"], 0, 0, 0])
        )
        robot.set_frame_velocity_representation(Representations.BODY_FIXED_REPRESENTATION)
        q, n = ca.SX.sym("q", 7 + len(names)), len(names)
        R, s = ca.SX.sym("R", 3, 3), ca.SX.sym("s", n)
        H = ca.vertcat(ca.horzcat(R, ca.SX.zeros(3)), ca.horzcat(0, 0, 0, 1))
        G = robot.gravity_term(H, s)
        J = ca.vertcat(*[robot.jacobian(frame, H, s) for frame in problem["frames"]])
        Jb, Jj, Gb, Gj = J[:, :6], J[:, 6:], G[:6], G[6:]

        def spd(A: Any, b: Any) -> Any:
            # Cholesky's factors as expressions: they keep the pattern of A.
            D, L, p = ca.ldl(A)
            return ca.ldl_solve(b, D, L, p)

        M = Jj @ Jj.T
        wrench = Jb @ spd(Jb.T @ Jb, Gb)
        MJ, Mg = spd(M, Jb), spd(M, Jj @ Gj)
        torque = Mg + MJ @ spd(Jb.T @ MJ, Gb - Jb.T @ Mg)
        forces, cops = [wrench, torque], []
        for f in forces:
            for k in (0, 6):
                cops += [-f[k + 4] / f[k + 2], f[k + 3] / f[k + 2]]
        cop = ca.vertcat(*cops)
        g = ca.jacobian(cop, ca.vertcat(ca.vec(R), s))
        turns = [ca.vec(R @ ca.skew(axis)) for axis in np.eye(3)]  # dR = R skew(e)
        g = ca.horzcat(ca.SX.zeros(8, 3), g[:, :9] @ ca.horzcat(*turns), g[:, 9:])
        g = g - spd(J @ J.T, J @ g.T).T @ J
        torques = [Gj - Jj.T @ f for f in forces]
        # Row-major, as NumPy's.
        flat = ca.densify(ca.vertcat(*forces, *torques, cop, ca.vec(g.T)))
        x, y, z, w = q[3], q[4], q[5], q[6]
        turned = ca.vertcat(
            ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            ca.horzcat(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            ca.horzcat(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
        inner = ca.Function("inner", [R, s], [flat])
        return ca.Function("statics", [q], [inner(turned, q[7:])])

    def answer(self) -> dict[str, np.ndarray]:
        """Answers for every configuration."""
        self.run()
        return unpacked(self.output, self.nv)


class JaxTool:
    """adam's JAX functions, mapped over a batch of postures and compiled by XLA."""

    def __init__(self, problem: dict[str, Any], folder: Path) -> None:
        """Trace and compile."""
        import jax

        jax.config.update("jax_enable_x64", True)
        import jax.numpy as jnp
        from adam import Representations
        from adam.jax import KinDynComputations

        names = problem["joints"]
        self.nv, self.jax = len(names) + 6, jax
        robot = KinDynComputations(
            problem["urdf"], names, gravity=np.array([*problem["gravity"], 0, 0, 0])
        )
        robot.set_frame_velocity_representation(Representations.BODY_FIXED_REPRESENTATION)

        def skew(w: Any) -> Any:
            return jnp.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])

        def statics(v: Any, q: Any) -> Any:
            x, y, z, w = q[3], q[4], q[5], q[6]
            R = jnp.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
                ]
            )
            # Exact to first order in v, which is where it is differentiated.
            H = jnp.eye(4).at[:3, :3].set(R @ (jnp.eye(3) + skew(v[3:6])))
            s = q[7:] + v[6:]
            G = robot.gravity_term(H, s)
            J = jnp.vstack([robot.jacobian(frame, H, s) for frame in problem["frames"]])
            Jb, Jj, Gb, Gj = J[:, :6], J[:, 6:], G[:6], G[6:]
            wrench = Jb @ jnp.linalg.solve(Jb.T @ Jb, Gb)
            M = Jj @ Jj.T
            found = jnp.linalg.solve(M, jnp.column_stack([Jb, Jj @ Gj]))
            MJ, Mg = found[:, :6], found[:, 6]
            torque = Mg + MJ @ jnp.linalg.solve(Jb.T @ MJ, Gb - Jb.T @ Mg)
            f = jnp.stack([wrench, torque]).reshape(2, 2, 6)
            cops = jnp.stack([-f[..., 4] / f[..., 2], f[..., 3] / f[..., 2]], axis=-1)
            torques = [Gj - Jj.T @ wrench, Gj - Jj.T @ torque]
            return cops.ravel(), (f.ravel(), jnp.concatenate(torques), cops.ravel(), J)

        differentiated = jax.jacrev(statics, has_aux=True)

        def whole(q: Any) -> Any:
            g, (f, torques, cops, J) = differentiated(jnp.zeros(self.nv), q)
            g = g - jnp.linalg.solve(J @ J.T, J @ g.T).T @ J
            return jnp.concatenate([f, torques, cops, g.ravel()])

        q = problem["q"]
        self.q = jnp.asarray(q[np.arange(BATCH) % len(q)])
        self.count = len(q)
        self.call = jax.jit(jax.vmap(whole)).lower(self.q).compile()

    def run(self) -> int:
        """Evaluate the batch."""
        self.call(self.q).block_until_ready()
        return BATCH

    def answer(self) -> dict[str, np.ndarray]:
        """Answers for every configuration."""
        return unpacked(np.asarray(self.call(self.q))[: self.count], self.nv)


TOOLS = {"casadi": CasadiTool, "jax": JaxTool}


if __name__ == "__main__":
    main()
