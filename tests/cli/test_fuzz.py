"""Whatever is typed, a command answers with an exit code it documents."""

import string

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.commands import copsense

TYPED = (
    "nan inf -inf 0 -1 1e308 1e-308 l_hip l_sole l_sole:point l_hip=5 l_hip=nan l_hip=0:3:2 l_hip= "
    "0:0.01:2 0:1 nan:0:2 0:1e9:2 -0.1:0.1:-0.1:0.1 minimum-torque minimum-wrench -- = ::: é / ."
)
WORDS = st.one_of(
    st.sampled_from(["", *TYPED.split()]),
    st.text(alphabet=string.printable + "éπ日\u202e", max_size=8),
    st.floats(width=32).map(str),
)
OPTIONS = {
    "analyse": ["--com-x", "--com-y", "--joint", "--along", "--contact", "--sole", "--sole-height",
                "--posture", "--base-yaw", "--width", "--criterion", "--characteristic-length"],
    "sweep": ["--com-y", "--joint", "--configurations", "--contact", "--sole", "--posture",
              "--width", "--criterion", "--characteristic-length"],
    "four-bar": ["--leg-length", "--rod-length", "--leg-mass", "--body-mass", "--xi", "--criterion",
                 "--characteristic-length", "--hip-weight", "--ankle-weight"],
}  # fmt: skip


@st.composite
def lines(draw):
    command = draw(st.sampled_from(sorted(OPTIONS)))
    options = draw(
        st.lists(st.tuples(st.sampled_from(OPTIONS[command]), WORDS), min_size=1, max_size=3)
    )
    robot = [] if command == "four-bar" else [draw(st.sampled_from(["four_bar"] * 5 + [""]))]
    json = draw(st.sampled_from([[], ["--json"]]))
    # One word with its option, so that a value may begin with a dash.
    return [command, *robot, *(f"{name}={value}" for name, value in options), *json]


@settings(
    max_examples=250,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(lines())
def test_any_line_ends_in_a_documented_exit_code(line):
    answer = copsense(*line)
    assert answer.code in (0, 1, 2), answer.err
    if answer.code == 2:
        assert answer.out == ""
        assert "error: " in answer.err.lower()
    if answer.code == 0 and "--json" in line:
        assert answer.json
