"""Does the kernel equal the reference? On 10 000 random postures, gradients included.

    python benchmarks/equality.py [--count 10000] [--jobs 2]

Postures are drawn with a `PostureChart` (CoM, orientation of the base, joints off the limbs) on
two, three and four contacts of seven robots, on flat ground, slopes, tables and walls, within the
joint limits. Every kind of criterion that the kernel serves is evaluated by both. Prints a Markdown
table of the largest difference of a posture's quantity, relative to the largest entry of that
quantity there; exits with 1 if one is over 1e-9.
"""

import argparse
import platform
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numba
import numpy as np
import pinocchio as pin

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.batch.statics import batch_kernel
from copsense.posture import supporting_joints

ALLOWED = 1e-9
WHAT = ("wrenches", "torques", "cops", "gradient", "com_gain", "com_travel", "tipping_edge")
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
    rng, mask = np.random.default_rng(seed), supporting_joints(stance)
    free = [j for j in stance.robot.joint_names if not mask[stance.robot.velocity_index(j)]]
    chart = PostureChart(stance, ["com_x", "com_y", "com_z", "roll", "pitch", "yaw", *free])
    size = np.array([LENGTH] * 3 + [TILT] * 3 + [TURN] * len(free))
    found, tried = [], 0
    while sum(len(q) for q in found) < count:
        offset = size * rng.uniform(-1, 1, (4 * count, len(size)))
        offset[:, 2] -= LENGTH / 2  # lower, where the legs can follow
        batch = chart.solve(chart.values + offset)
        found.append(batch.configurations[batch.converged])
        tried += len(offset)
        if tried > 1000 * count:
            raise SystemExit(f"no postures of {stance.robot.name} found: {batch.reasons[0]}")
    return np.vstack(found)[:count]


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


def main():
    """Compare every case in shares, and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=10000, help="postures in all")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    arguments = parser.parse_args()
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
