"""Does the kernel equal the reference? On 10 000 random postures, gradients included.

    python benchmarks/equality.py [--count 10000] [--jobs 2] [--limits]

Postures are drawn with a `PostureChart` (CoM, orientation of the base, joints off the limbs) on
two, three and four contacts of seven robots, on flat ground, slopes, tables and walls, within the
joint limits. Every kind of criterion that the kernel serves is evaluated by both. Prints a Markdown
table of the largest difference of a posture's quantity, relative to the largest entry of that
quantity there; exits with 1 if one is over 1e-9.

With `--limits` the same within limits that press on about half of the postures, on five robots, one
of them with its hands too: wrenches, derivatives and multipliers, both sides of the changes found
between neighbours, the travel to the nearest change and the limit that changes, every optimum's
violation of its conditions, and for every infeasible posture
and a fifth of the others a linear program that says whether it has any wrench within the limits.
"""

import argparse
import platform
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numba
import numpy as np
import pinocchio as pin
from scipy.optimize import linprog

import copsense
from copsense import Limits
from copsense.batch import BatchKernel, PostureChart
from copsense.batch.statics import batch_kernel
from copsense.errors import InvalidInputError
from copsense.limits import limit_rows
from copsense.load_problem import LoadProblem
from copsense.posture_system import supporting_joints

ALLOWED = 1e-9
WHAT = (
    "wrenches",
    "torques",
    "cops",
    "gradient",
    "com_gain",
    "com_travel",
    "unloading_travel",
    "tipping_edge",
)
LENGTH = 0.03  # m: how far the CoM is drawn from the stance's, either way
TILT = 0.12  # rad: likewise the base's roll, pitch and yaw
TURN = 0.4  # rad: likewise every joint off the limbs


def on_slopes(name, tilt, step, contacts=slice(None)):
    """A robot with each foot on a plane of its own."""
    stance, rng, placed = copsense.load_stance(name), np.random.default_rng(7), []
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        x, y, _ = place.translation
        point = (float(x), float(y), float(rng.uniform(0, step)))
        plane = copsense.Plane(point, (*rng.uniform(-tilt, tilt, 2), 1.0))
        placed.append(replace(contact, plane=plane))
    return copsense.robots.stand(stance.robot, placed[contacts], stance.q)


def with_hands(name, *hands):
    """A robot with hands in contact: (frame, normal) of a point, or (frame, None) laid flat."""
    stance = copsense.load_stance(name)
    for frame, normal in hands:
        place = stance.with_contacts([copsense.Contact(frame)]).placements[0]
        if normal is None:
            sole = np.array([[-0.03, -0.03], [0.03, -0.03], [0.0, 0.03]])
            hand = copsense.Contact(frame, rotation=np.array(place.rotation.T), polygon=sole)
        else:
            plane = copsense.Plane(tuple(float(c) for c in place.translation), normal)
            hand = copsense.Contact(frame, kind="point", plane=plane)
        stance = stance.with_contacts([*stance.contacts, hand])
    return stance


CASES = {
    "icub, flat": lambda: copsense.load_stance("icub"),
    "talos, slopes": lambda: on_slopes("talos", 0.15, 0.03),
    "g1, slopes": lambda: on_slopes("g1", 0.1, 0.02),
    "human, flat": lambda: copsense.load_stance("human"),
    "romeo, flat": lambda: copsense.load_stance("romeo"),
    "icub, hand on a wall": lambda: with_hands("icub", ("l_hand", (-1, 0.2, 0.1))),
    "icub, hand laid flat": lambda: with_hands("icub", ("l_hand", None)),
    "talos, hand on a table": lambda: with_hands("talos", ("arm_left_7_joint", (0.1, 0.0, 1.0))),
    "solo12, three feet, slopes": lambda: on_slopes("solo12", 0.3, 0.03, slice(1, None)),
    "icub, hands on wall and table": lambda: with_hands(
        "icub", ("l_hand", (-1, 0.2, 0.1)), ("r_hand", (0.1, 0.0, 1.0))
    ),
    "anymal_c, flat": lambda: copsense.load_stance("anymal_c"),
}


def criteria_of(stance):
    """The criteria that the kernel serves."""
    wrench, torque = copsense.minimum_wrench(0.7), copsense.minimum_torque()
    weights = copsense.weighted_torque(np.linspace(0.5, 3.0, len(stance.robot.torque_names)))
    return [wrench, torque, weights, copsense.mixed((wrench, 0.3), (torque, 1.0))]


def draw(stance, count, seed):
    """Random postures on the contacts, within the joint limits (count, nq)."""
    return drawn(stance, count, seed)[2]


def drawn(stance, count, seed):
    """The same with the chart and its coordinates (count, nx)."""
    rng, mask = np.random.default_rng(seed), supporting_joints(stance)
    free = [j for j in stance.robot.joint_names if not mask[stance.robot.velocity_index(j)]]
    chart = PostureChart(stance, ["com_x", "com_y", "com_z", "roll", "pitch", "yaw", *free])
    size = np.array([LENGTH] * 3 + [TILT] * 3 + [TURN] * len(free))
    found, values, tried = [], [], 0
    while sum(len(q) for q in found) < count:
        offset = size * rng.uniform(-1, 1, (4 * count, len(size)))
        offset[:, 2] -= LENGTH / 2  # lower, where the legs can follow
        batch = chart.solve(chart.values + offset)
        found.append(batch.configurations[batch.converged])
        values.append((chart.values + offset)[batch.converged])
        tried += len(offset)
        if tried > 1000 * count:
            raise SystemExit(f"no postures of {stance.robot.name} found: {batch.reasons[0]}")
    return chart, np.vstack(values)[:count], np.vstack(found)[:count]


def largest_error(given, expected):
    """Largest difference, relative to the largest finite entry expected."""
    finite = np.isfinite(expected)
    if not np.array_equal(given[~finite], expected[~finite]) or np.isnan(given).any():
        return np.inf
    if not finite.any():
        return 0.0
    size = max(float(np.abs(expected[finite]).max()), 1e-12)
    return float(np.abs(given[finite] - expected[finite]).max()) / size


def reference_answer(stance, q, criterion):
    """What the kernel's arrays should hold, from `cop_sensitivity`; or why it raises."""
    try:
        expected = copsense.cop_sensitivity(stance.at(q), criterion)
    except copsense.CopsenseError as error:
        return str(error)
    return {
        "wrenches": expected.equilibrium.wrenches,
        "torques": expected.equilibrium.torques,
        "cops": expected.cop,
        "gradient": expected.gradient,
        "com_gain": expected.com_gain,
        "com_travel": expected.com_travel,
        "tipping_edge": expected.tipping_edge,
        "unloading_travel": expected.unloading_travel,
    }


def compare(name, start, count):
    """Of one case: contacts, rows, rows that the kernel left or that failed, and the errors.

    The share of a case begins at its posture `start`, so that shares differ.
    """
    stance = CASES[name]()
    q = draw(stance, start + count, seed=list(CASES).index(name))[start:]
    criteria, left, fill = criteria_of(stance), [], batch_kernel.fill_row

    def counted(*arguments):
        left.append(arguments[-2:])
        return fill(*arguments)

    batch_kernel.fill_row = counted
    found = BatchKernel(stance, criteria).evaluate(q)
    errors = dict.fromkeys(WHAT, 0.0)
    for i, j in np.ndindex(len(q), len(criteria)):
        expected = reference_answer(stance, q[i], criteria[j])
        if isinstance(expected, str):
            if found.reasons.get((i, j)) != expected:
                errors = dict.fromkeys(WHAT, np.inf)
            continue
        for what, value in expected.items():
            errors[what] = max(errors[what], largest_error(getattr(found, what)[i, j], value))
    return name, len(stance.contacts), count, len(left), len(found.reasons), errors


WITHIN = (
    "icub, flat",
    "talos, slopes",
    "g1, slopes",
    "human, flat",
    "romeo, flat",
    "icub, hands on wall and table",
)
LIMITED = (*WHAT[:-1], "multipliers", "change_travel", "one-sided", "at changes")
COUNTED = ("pressed", "infeasible", "touching", "wrong", "wrong at changes")
TIED = 1e-9  # relative difference of two limits' travels, of which either may be said to be first
NEAREST = 1e-5  # m: of shorter travels the difference is relative to this
EXACT = 1e-9  # weights: relaxation, of rows of norm one, that is none
FLOOR = 1e-3  # of a quantity's size: gains where limits hold a CoP are zero but for rounding


def limits_of(stance, criteria):
    """Limits that press on about half of the postures."""
    own = BatchKernel(stance, criteria, gains=False).evaluate(draw(stance, 60, seed=99))
    f = own.wrenches
    slip = (np.hypot(f[..., 0], f[..., 1]) / np.abs(f[..., 2])).max(axis=-1)
    peak = np.abs(own.torques).max(axis=-1)
    return Limits(
        friction=float(np.quantile(slip, 0.7)),
        torque=float(np.quantile(peak, 0.7)),
        torsion=0.03,
        cop_margin=0.005,
    )


def changes(kernel, chart, values, result):
    """Configurations at which a limit begins or ceases to press, between neighbouring postures.

    By bisection along the straight line in the chart's coordinates, until a limit only touches.
    """
    sets = [[frozenset(p[p >= 0]) for p in row] for row in result.limits.pressing]
    fine = (result.limits.state < 2).all(axis=1)
    pairs = [
        i
        for i in range(0, len(values) - 1, 2)
        if fine[i] and fine[i + 1] and sets[i][1] != sets[i + 1][1]
    ]
    low, high, found = values[pairs], values[[i + 1 for i in pairs]], {}
    first = [sets[i][1] for i in pairs]
    for _ in range(70):
        middle = (low + high) / 2
        batch = chart.solve(middle)
        there = np.flatnonzero(batch.converged)
        at = kernel.evaluate(batch.configurations[there])
        same = np.zeros(len(pairs), dtype=bool)
        for n, k in enumerate(there):
            pressing = at.limits.pressing[n, 1]
            same[k] = frozenset(pressing[pressing >= 0]) == first[k]
            if at.limits.touching[n, 1] == 1 and at.limits.state[n, 1] < 2:
                found.setdefault(int(k), batch.configurations[k])
        low, high = np.where(same[:, None], middle, low), np.where(same[:, None], high, middle)
    return np.array([*found.values()]).reshape(len(found), -1)


def feasible(stance, q, limits):
    """Whether a linear program finds wrenches within the limits."""
    here = stance.at(q)
    problem = LoadProblem.of(here)
    A, b = limit_rows(here, limits).over_forces(problem)
    unit, scale = stance.robot.weight, np.linalg.norm(A, axis=1)
    scale[scale < 1e-12] = 1.0
    # The least t by which all rows have to be relaxed: a program that always has an answer.
    rows = np.column_stack([A / scale[:, None], -np.ones(len(b))])
    balance = np.column_stack([problem.base_map, np.zeros(len(problem.base_wrench))])
    bounds = [(-1e3, 1e3)] * A.shape[1] + [(0, None)]
    cost, bound, load = np.eye(len(bounds))[-1], b / scale / unit, problem.base_wrench / unit
    for method in ("highs", "highs-ds", "highs-ipm"):
        found = linprog(cost, rows, bound, balance, load, bounds, method=method)
        if found.status == 0:
            return float(found.fun) <= EXACT
    raise SystemExit(f"the linear program ended with status {found.status}: {found.message}")


def both_sides(expected):
    """One-sided d cop / d CoM (side, contact, axis, CoM x or y); NaN where there is no way."""
    both = np.full((2, *expected.com_gain.shape), np.nan)
    for n, side in enumerate((-1, 1)):
        for axis, motion in enumerate(expected.com_motions.T):
            try:
                both[n, :, :, axis] = expected.one_sided(motion, side=side)
            except InvalidInputError:
                continue
    return both


def compare_changes(within, i, j, expected):
    """Relative difference of the travels to the nearest change; whether the limits differ."""
    equilibrium, given = expected.equilibrium, within.change_travel[i, j]
    row, travel = equilibrium.nearest_changing_row(expected.com_motions)
    if not np.isfinite(travel):
        return 0.0 if given == travel else np.inf, within.change_limit[i, j] != row
    gap = abs(given - travel) / max(travel, NEAREST)
    if within.change_limit[i, j] == row:
        return gap, False
    # The limit that the kernel names, by the rates of its slack or multiplier: is it as near?
    other = within.change_limit[i, j]
    pressed = other in equilibrium.pressing
    rates = [equilibrium.rates(motion) for motion in expected.com_motions.T]
    speed = np.hypot(*(r.multipliers[other] if pressed else r.slack[other] for r in rates))
    left = equilibrium.row_multipliers[other] if pressed else equilibrium.slack[other]
    return gap, abs(left / speed - travel) > TIED * max(travel, NEAREST)


def compare_within(name, start, count):
    """Of one case: what `compare` gives, within limits."""
    stance = CASES[name]()
    chart, values, q = drawn(stance, start + count, seed=list(CASES).index(name))
    values, q = values[start:], q[start:]
    criteria = criteria_of(stance)
    limits = limits_of(stance, criteria)
    kernel = BatchKernel(stance, criteria, limits)
    found = kernel.evaluate(q)
    turns = changes(kernel, chart, values, found)
    drawn_first, q = len(q), np.vstack([q, turns])
    found = kernel.evaluate(q)
    sides = kernel.one_sided_gains(q, found)
    errors = dict.fromkeys(LIMITED, 0.0)
    counts = dict.fromkeys(COUNTED, 0)
    for i, j in np.ndindex(len(q), len(criteria)):
        state = found.limits.states[found.limits.state[i, j]]
        counts["pressed"] += state == "pressed"
        counts["infeasible"] += state == "infeasible"
        counts["touching"] += int(found.limits.touching[i, j] > 0)
        if j == 0 and (state == "infeasible" or i % 5 == 0):
            counts["wrong"] += (state != "infeasible") != feasible(stance, q[i], limits)
        try:
            expected = copsense.cop_sensitivity(stance.at(q[i]), criteria[j], limits)
        except copsense.CopsenseError as error:
            counts["wrong"] += found.reasons.get((i, j), "")[:60] != str(error)[:60]
            continue
        equilibrium = expected.equilibrium
        pressing, multipliers = found.limits.pressing[i, j], np.zeros(len(found.limits.names))
        multipliers[pressing[pressing >= 0]] = found.limits.multipliers[i, j][pressing >= 0]
        both = np.stack([expected.com_gain] * 2)
        if found.limits.touching[i, j] or i % 20 == 0:
            both = both_sides(expected)
        pairs = {
            "wrenches": (found.wrenches[i, j], equilibrium.wrenches),
            "torques": (found.torques[i, j], equilibrium.torques),
            "cops": (found.cops[i, j], expected.cop),
            "gradient": (found.gradient[i, j], expected.gradient),
            "com_gain": (found.com_gain[i, j], expected.com_gain),
            "com_travel": (found.com_travel[i, j], expected.com_travel),
            "unloading_travel": (found.unloading_travel[i, j], expected.unloading_travel),
            "multipliers": (multipliers, equilibrium.row_multipliers),
            "one-sided": (sides[i, j], both),
        }
        for what, (given, value) in pairs.items():
            finite = np.isfinite(value)
            size = max(float(np.abs(value[finite]).max(initial=0.0)), FLOOR)
            same = np.array_equal(given[~finite], value[~finite], equal_nan=True)
            gap = np.abs(given[finite] - value[finite]).max(initial=0.0) / size
            if i >= drawn_first and what != "one-sided":
                what = "at changes" if what != "multipliers" else ""
            if what:
                errors[what] = max(errors[what], float(gap) if same else np.inf)
        presses = pressing[pressing >= 0]
        wrong = "wrong" if i < drawn_first else "wrong at changes"
        if set(presses.tolist()) != set(equilibrium.pressing.tolist()):
            counts[wrong] += 1
            continue
        if i < drawn_first:
            gap, other = compare_changes(found.limits, i, j, expected)
            errors["change_travel"] = max(errors["change_travel"], float(gap))
            counts["wrong"] += int(other)
    optimality = float(np.nanmax(found.limits.optimality))
    return name, len(q), len(turns), counts, optimality, errors


def main_within(arguments):
    """Compare five robots, one with its hands too, within limits in shares, and print the table."""
    each = -(-arguments.count // len(WITHIN))
    shares = [(n, s, min(200, each - s)) for n in WITHIN for s in range(0, each, 200)]
    rows = {}
    with ProcessPoolExecutor(arguments.jobs) as pool:
        answers = pool.map(compare_within, *zip(*shares, strict=True))
        for done, (name, postures, turns, counts, optimality, errors) in enumerate(answers, 1):
            row = rows.setdefault(name, [0, 0, dict.fromkeys(counts, 0), 0.0, errors])
            row[0], row[1], row[3] = row[0] + postures, row[1] + turns, max(row[3], optimality)
            row[2] = {what: row[2][what] + counts[what] for what in counts}
            row[4] = {what: max(row[4][what], errors[what]) for what in LIMITED}
            print(f"\r{done}/{len(shares)} shares", end="", file=sys.stderr)
    print(file=sys.stderr)
    print("Within limits, largest relative difference of kernel and reference, four criteria a")
    print("posture. *changes*: postures among them at which a limit only touches, found between")
    print("neighbours; *pressed*, *infeasible*: answers; *wrong*: answers whose state differs from")
    print(
        "the reference's or a linear program's, with other pressing limits, or with another limit"
    )
    print("that changes first unless two are as near; *optimality*: the largest violation of an")
    print("optimality condition; *change travel*: how far the CoM may go before a limit begins or")
    print(
        "ceases to press, of travels under 10 um the difference over that. *At changes* a limit is"
    )
    print(
        "within 1e-9 of the weight of its bound, where either set of pressing limits is an optimum"
    )
    print("to that tolerance: counted apart, the largest difference of any quantity but the")
    print("multipliers.\n")
    head = [what.replace("_", " ") for what in LIMITED]
    titles = "case | postures | changes | pressed | infeasible | wrong | there | optimality"
    print(f"| {titles} | {' | '.join(head)} |")
    print("|---" * (8 + len(LIMITED)) + "|")
    for name, (postures, turns, counts, optimality, errors) in rows.items():
        numbers = " | ".join(f"{errors[what]:.1e}" for what in LIMITED)
        print(
            f"| {name} | {postures} | {turns} | {counts['pressed']} | {counts['infeasible']} | "
            f"{counts['wrong']} | {counts['wrong at changes']} | {optimality:.1e} | {numbers} |"
        )
    worst = max(row[4][what] for row in rows.values() for what in LIMITED[:-1])
    wrong = sum(row[2]["wrong"] for row in rows.values())
    total = sum(row[0] for row in rows.values())
    print(
        f"\n{total} postures, {4 * total} answers, largest difference {worst:.1e}, {wrong} wrong."
    )
    return int(worst > ALLOWED or wrong > 0 or max(row[3] for row in rows.values()) > 1e-8)


def main():
    """Compare every case in shares, and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=10000, help="postures in all")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--limits", action="store_true", help="within limits")
    arguments = parser.parse_args()
    if arguments.limits:
        return main_within(arguments)
    each = -(-arguments.count // len(CASES))
    shares = [(n, s, min(100, each - s)) for n in CASES for s in range(0, each, 100)]
    rows = {}
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for done, result in enumerate(pool.map(compare, *zip(*shares, strict=True)), 1):
            name, contacts, count, left, failed, errors = result
            row = rows.setdefault(name, [contacts, 0, 0, 0, dict.fromkeys(WHAT, 0.0)])
            row[1:4] = row[1] + count, row[2] + left, row[3] + failed
            row[4] = {what: max(row[4][what], errors[what]) for what in WHAT}
            print(f"\r{done}/{len(shares)} shares", end="", file=sys.stderr)
    print(file=sys.stderr)
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__},")
    print(f"Pinocchio {pin.__version__}, {platform.machine()}, {platform.system()}.\n")
    print("Largest relative difference of kernel and reference, four criteria a posture; *left* is")
    print("how many answers the kernel left to the reference, *failed* how many neither has.\n")
    head = [what.replace("_", " ") for what in WHAT]
    print(f"| case | contacts | postures | left | failed | {' | '.join(head)} |")
    print("|---" * (5 + len(WHAT)) + "|")
    for name, (contacts, count, left, failed, errors) in rows.items():
        numbers = " | ".join(f"{errors[what]:.1e}" for what in WHAT)
        print(f"| {name} | {contacts} | {count} | {left} | {failed} | {numbers} |")
    total = sum(row[1] for row in rows.values())
    worst = max(max(row[4].values()) for row in rows.values())
    print(f"\n{total} postures, {4 * total} answers, largest difference {worst:.1e}.")
    return int(worst > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
