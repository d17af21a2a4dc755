"""Protects the check of members: invalid members are found before anything runs, and named."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.configs import VISCO_ELASTIC, edited, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.sweep.plan.load import load_plan

FULL = edited("[400, 400, 320]", "[[400, 50, 0], [50, 400, 0], [0, 0, 320]]")


def outcome(vary, base=VISCO_ELASTIC, members=200, design="random"):
    """Return the plan, or its one problem: the key, the number of the member and the message."""
    data = {"base": plain(base), "vary": vary}
    if design != "grid":
        data |= {"design": design, "members": members, "seed": 4}
    try:
        return load_plan(data)
    except ConfigError as error:
        (problem,) = error.problems
        words = problem.problem.split()
        assert words[:2] == ["at", "member"]
        return problem.key, int(words[2]), " ".join(words[3:]) + f" ({problem.expected})"


def test_the_least_value_is_named():
    vary = {"body.mass": {"normal": [1, 1]}}
    key, number, message = outcome(vary)
    shifted = load_plan(
        {
            "base": plain(),
            "vary": {"gravity[0]": {"normal": [1, 1]}},
            "design": "random",
            "members": 200,
            "seed": 4,
        }
    ).values(0, 200)["gravity[0]"]
    assert (key, number) == ("vary.body.mass", int(np.argmin(shifted)))
    assert message == f"body.mass is {shifted.min():.12g} (expected a number greater than 0)"


def coupled(a, b, c):
    """Return the varied entries of a matrix."""
    return {
        "controller.K_r[0][0]": a,
        "off": {"zip": {"controller.K_r[0][1]": b, "controller.K_r[1][0]": c}},
    }


def entries(*values):
    return {"values": list(values)}


def factors(*values):
    return {"scale": entries(*values)}


TURNED = edited("orientation: [0, 0, 0]", "orientation: [0, 0.2, 0]", FULL)
COUPLED = edited("[400, 400, 320]", "[[400, 50, 20], [50, 400, 20], [20, 20, 320]]")
HEAVY = edited("[10.0, 8.0, 0.4]", "[[10.0, 1.0, 0], [1.0, 8.0, 0], [0, 0, 0.4]]", FULL)
TIED = edited("[12300, 12300, 9840]", "[[2, 1, 0], [1, 2, 0], [0, 0, 2]]", VISCO_ELASTIC)
BESIDE = [f"controller.K_r[{i}][{j}]" for i, j in ((0, 2), (2, 0), (1, 2), (2, 1))]
TWO_VARIANTS = {"controller.variant": entries("free", "visco-elastic")}
SOME = {"linspace": [-100, 100, 5]}
SINGULAR = "controller.K_r is not positive semidefinite, its smallest eigenvalue is -"

# A base, what varies in a grid (its first key is wrong), an invalid member, and its message.
WRONG = [
    (
        VISCO_ELASTIC,
        {"initial.orientation[1]": {"linspace": [0, 1.6, 17]}},
        16,
        "initial.orientation θ2 = 1.6 rad (91.6732°) is outside the range of eq. 5",
    ),
    # The first of equal members.
    (
        VISCO_ELASTIC,
        {"body.mass": entries(1, 2, -1), "gravity[0]": {"linspace": [1, 2, 100_000]}},
        200_000,
        "body.mass is -1",
    ),
    (TURNED, {"controller.K_t": factors(1, -1)}, 1, "controller.K_t[0] is -4100"),
    (TURNED, {"controller.K_t": factors(1, 1e305)}, 1, "controller.K_t[0] is inf"),
    (TURNED, {"body.inertia": factors(0, 1)}, 0, "body.inertia[0] is 0"),
    (TURNED, {"body.mass": factors(-2, 1)}, 0, "body.mass is -82"),
    (TURNED, {"controller.K_r": factors(1, -1)}, 1, SINGULAR),
    (
        TURNED,
        {"initial.orientation": {"scale": {"linspace": [-9, 9, 3]}}},
        0,
        "initial.orientation θ2 = -1.8 rad (-103.132°) is",
    ),
    # The entries of a matrix: 400 x 400 > 100² and 100 x 400 > 100², but not 20 x 400 < 100².
    (FULL, coupled(entries(400, 20), SOME, SOME), 5, SINGULAR),
    (
        FULL,
        coupled(entries(400), SOME, {"linspace": [-100, 101, 5]}),
        1,
        "controller.K_r is not symmetric (expected a symmetric matrix)",
    ),
    # The entries beside the diagonal are 50 times the factor, and must stay below 400.
    (
        FULL,
        {"off": {"zip": dict.fromkeys(coupled(0, 0, 0)["off"]["zip"], factors(1, 7.9, 8.1))}},
        2,
        SINGULAR,
    ),
    (
        HEAVY,
        {"body.inertia[2][2]": entries(0.4, 1.7e308)},
        1,
        "body.inertia is not positive definite beyond round-off",
    ),
    # The eigenvalues of a matrix that overflows cannot be computed.
    (
        COUPLED,
        {"row": {"zip": dict.fromkeys(BESIDE, factors(1, 1e308))}},
        1,
        "controller.K_r[0][2] is inf (expected a finite number)",
    ),
    (FULL, {"controller.K_r[2][2]": factors(1, 1e307)}, 1, "controller.K_r[2][2] is inf"),
    (FULL, {"controller.K_r": factors(1, 1e307)}, 1, "controller.K_r[0][0] is inf"),
    # Some variants have the key, or all of them.
    (
        TIED,
        {"controller.K_c[0][0]": entries(1, 0.1), **TWO_VARIANTS, "gravity[0]": entries(1, 2)},
        6,
        "controller.K_c is not",
    ),
    (VISCO_ELASTIC, {"body.mass": entries(1, -1), **TWO_VARIANTS}, 2, "body.mass is -1"),
]


@pytest.mark.parametrize(("base", "vary", "number", "message"), WRONG)
def test_a_wrong_member_is_named(base, vary, number, message):
    key, member, text = outcome(vary, base, design="grid")
    assert key.startswith(f"vary.{next(iter(vary))}")
    assert member == number
    assert text.startswith(message)


RIGHT = [
    # The distributions allow invalid values, but none of these members has one.
    ({"body.mass": {"normal": [8, 1.5]}}, "random"),
    ({"body.mass": {"uniform": [0, 1]}}, "random"),
    (coupled(entries(100, 400), SOME, SOME), "grid"),
    # A stiffness may be singular.
    ({"controller.K_r[2][2]": entries(320, 0, 1.7e308)}, "grid"),
]


@pytest.mark.parametrize(("vary", "design"), RIGHT)
def test_right_members(vary, design):
    plan = outcome(vary, FULL, design=design)
    for number in range(plan.members):
        plan.config_of(number)


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(st.floats(-50, 500), st.floats(1, 300)),
    st.tuples(st.floats(-300, 300), st.floats(1, 300)),
    st.sampled_from(["random", "sobol", "latin-hypercube"]),
)
def test_what_is_accepted_can_be_replayed_and_what_is_refused_cannot(diagonal, off, design):
    entry = {"normal": list(off)}
    vary = coupled({"normal": list(diagonal)}, entry, entry)
    vary |= {"body.mass": {"normal": [5, 1.6]}, "initial.orientation[1]": {"normal": [0, 0.4]}}
    data = {"base": plain(FULL), "vary": vary, "design": design, "members": 40, "seed": 2}
    loose = data | {"vary": {f"gravity[{i}]": {"normal": [0, 1]} for i in range(3)}}
    coordinates = load_plan(loose).values(0, 40)
    assert len(coordinates) == 3
    try:
        plan = load_plan(data)
    except ConfigError as error:
        for problem in error.problems:
            assert "at member" in problem.problem
        assert any(wrong(data, number) for number in range(40))
    else:
        for number in range(40):
            plan.config_of(number)


def wrong(data, number):
    """Return whether a member is invalid as a single config, without the check of plans."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rbstab.sweep.plan.load.problems_of_members", lambda *_: [])
        plan = load_plan(data)
    try:
        plan.config_of(number)
    except ConfigError:
        return True
    return False


def test_problems_of_several_columns_come_together():
    vary = {"body.mass": {"values": [-1]}, "controller.K_t[1]": {"values": [-1]}}
    with pytest.raises(ConfigError) as caught:
        load_plan({"base": plain(), "vary": vary})
    assert [problem.key for problem in caught.value.problems] == [
        "vary.body.mass",
        "vary.controller.K_t[1]",
    ]


def test_a_whole_number_of_the_config_does_not_vary(complaints, tmp_path):
    text = edited("visco-elastic", "sliding")
    lines = [line for line in text.splitlines() if "_c:" not in line]
    text = "\n".join(lines).replace("  K_t:", "  K_s: [1, 1, 1]\n  surface: position\n  K_t:")
    (tmp_path / "sliding.yaml").write_text(text)
    load_config(tmp_path / "sliding.yaml")
    (message,) = complaints(
        "base: sliding.yaml\nvary:\n  controller.switch_limit: {values: [10, 20]}\n"
    )
    assert message == (
        "3:3: vary.controller.switch_limit: is a whole number, which all members share"
        " (expected a key of another number)"
    )
