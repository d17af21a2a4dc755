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


def test_the_greatest_value_is_named_where_the_least_is_right():
    vary = {"initial.orientation[1]": {"linspace": [0, 1.6, 17]}}
    assert outcome(vary, design="grid") == (
        "vary.initial.orientation[1]",
        16,
        "initial.orientation θ2 = 1.6 rad (91.6732°) is outside the range of eq. 5 (expected θ1 "
        "and θ3 between ±180°, θ2 inside of ±90°; degrees are {deg: [...]})",
    )


def test_the_first_of_equal_members_is_named():
    vary = {"gravity[0]": {"values": [1, 2]}, "body.mass": {"values": [1, -1, 2]}}
    assert outcome(vary, design="grid")[1] == 1
    vary = {"body.mass": {"values": [1, 2, -1]}, "gravity[0]": {"linspace": [1, 2, 100_000]}}
    assert outcome(vary, design="grid")[1] == 200_000


def test_what_no_member_has_is_no_problem():
    """The distribution allows invalid values, but none of these members has one."""
    assert outcome({"body.mass": {"normal": [8, 1.5]}}).values(0, 200)["body.mass"].min() > 0
    assert outcome({"body.mass": {"uniform": [0, 1]}}).values(0, 200)["body.mass"].min() > 0


FACTORS = [
    ("controller.K_t", {"values": [1, -1]}, "controller.K_t[0] is -4100"),
    ("body.inertia", {"values": [0, 1]}, "body.inertia[0] is 0"),
    ("controller.K_t", {"values": [1, 1e305]}, "controller.K_t[0] is inf"),
    ("body.mass", {"values": [-2, 1]}, "body.mass is -82"),
    (
        "controller.K_r",
        {"values": [1, -1]},
        "controller.K_r is not positive semidefinite, its smallest",
    ),
    (
        "initial.orientation",
        {"linspace": [-9, 9, 3]},
        "initial.orientation θ2 = -1.8 rad (-103.132°) is",
    ),
]


@pytest.mark.parametrize(("key", "factors", "message"), FACTORS)
def test_factors(key, factors, message):
    base = edited("orientation: [0, 0, 0]", "orientation: [0, 0.2, 0]", FULL)
    found = outcome({key: {"scale": factors}}, base, design="grid")
    assert found[0] == f"vary.{key}"
    assert found[2].startswith(message)


def coupled(a, b, c):
    """Return the varied entries of a matrix."""
    return {
        "controller.K_r[0][0]": a,
        "off": {"zip": {"controller.K_r[0][1]": b, "controller.K_r[1][0]": c}},
    }


def test_entries_of_a_matrix_are_judged_together():
    some = {"linspace": [-100, 100, 5]}
    # Positive definite: 400 x 400 > 100² and 100 x 400 > 100², but not 20 x 400 < 100².
    outcome(coupled({"values": [100, 400]}, some, some), FULL, design="grid").config_of(9)
    key, number, message = outcome(coupled({"values": [400, 20]}, some, some), FULL, design="grid")
    assert (key, number) == ("vary.controller.K_r[0][0]", 5)
    assert message.startswith(
        "controller.K_r is not positive semidefinite, its smallest eigenvalue is -"
    )
    other = {"linspace": [-100, 101, 5]}
    _, number, message = outcome(coupled({"values": [400]}, some, other), FULL, design="grid")
    assert (number, message) == (1, "controller.K_r is not symmetric (expected a symmetric matrix)")


def test_entries_of_a_matrix_that_are_scaled():
    """The entries beside the diagonal are 50 times the factor, and must stay below 400."""
    factors = {"scale": {"values": [1, 7.9, 8.1]}}
    vary = {"off": {"zip": {"controller.K_r[0][1]": factors, "controller.K_r[1][0]": factors}}}
    assert outcome(vary, FULL, design="grid")[1] == 2
    vary["off"]["zip"] = {key: {"scale": {"values": [7.9]}} for key in vary["off"]["zip"]}
    matrix = outcome(vary, FULL, design="grid").config_of(0).controller.K_r
    assert matrix[0] == (400.0, 395.0, 0.0)


def test_a_matrix_with_a_huge_entry():
    base = edited("[10.0, 8.0, 0.4]", "[[10.0, 1.0, 0], [1.0, 8.0, 0], [0, 0, 0.4]]", FULL)
    huge = {"body.inertia[2][2]": {"values": [0.4, 1.7e308]}}
    _, number, message = outcome(huge, base, design="grid")
    assert number == 1
    assert message.startswith("body.inertia is not positive definite beyond round-off")
    # A stiffness may be singular.
    huge = {"controller.K_r[2][2]": {"values": [320, 0, 1.7e308]}}
    assert outcome(huge, FULL, design="grid").members == 3


def test_a_matrix_whose_entries_overflow():
    """The eigenvalues of such a matrix cannot be computed."""
    base = edited("[400, 400, 320]", "[[400, 50, 20], [50, 400, 20], [20, 20, 320]]")
    factors = {"scale": {"values": [1, 1e308]}}
    keys = [f"controller.K_r[{i}][{j}]" for i, j in ((0, 2), (2, 0), (1, 2), (2, 1))]
    _, number, message = outcome(
        {"row": {"zip": dict.fromkeys(keys, factors)}}, base, design="grid"
    )
    assert (number, message) == (1, "controller.K_r[0][2] is inf (expected a finite number)")


def test_a_matrix_of_one_variant():
    base = edited("[12300, 12300, 9840]", "[[2, 1, 0], [1, 2, 0], [0, 0, 2]]", VISCO_ELASTIC)
    vary = {
        "controller.variant": {"values": ["free", "visco-elastic"]},
        "gravity[0]": {"values": [1, 2, 3]},
        "controller.K_c[0][0]": {"values": [1, 0.1]},
    }
    key, number, _ = outcome(vary, base, design="grid")
    assert (key, number) == ("vary.controller.K_c[0][0]", 7)


def test_what_is_wrong_for_several_variants_is_told_of_the_first():
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}}
    assert outcome(vary | {"body.mass": {"values": [1, -1]}}, design="grid")[1] == 1


def test_a_matrix_with_an_endless_entry():
    for key in ("controller.K_r[2][2]", "controller.K_r"):
        found = outcome({key: {"scale": {"values": [1, 1e307]}}}, FULL, design="grid")
        assert found[1] == 1
        assert found[2].endswith(" is inf (expected a finite number)")


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
