"""Protects what must not be proved: code that is not shown to be passive, missing hypotheses."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.config_elements import CONTROLLER, TIE, UPRIGHT, config_data
from support.leg import BODY
from support.proved_code import FLOOR, REPELLING_GUARD, STIFF_GUARD, WEIGHT
from support.sliding_ties import tie
from support.switching_cords import CORD, REPELLING, TIGHTER, text_of
from support.user_code import ROPE, SPRING, element_text, loaded_with, python_section

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.config.load import config_to_read, load_config
from rbstab.config.schema import Config
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import CODE_NOT_RUN, prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.data import SUPPLIES
from rbstab.experiment.verification.verify import verify
from rbstab.proof.passive import passive, switches
from rbstab.proof.passive.passive import why_not_in_proofs


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def with_code(text, variant="permanent", *, others=(), **values):
    """Return the config of a body with one element of a user, and others."""
    Path("mine.py").write_text(text, encoding="utf-8")
    return loaded_with({"one": python_section(**values), **dict(others)}, variant)


SQUARE = "self.mode[0] * above * above"
GUARDS = "return np.array([pitch - self.soft, -pitch - self.soft])"
MODES = "above, below = self.mode * self.guards(motion, states)"
SOFT = {"k": 30.0, "soft": 0.3}
CORDS: dict[str, Any] = {"point": [0, 0, 0.4], "k": 31.0, "soft": 0.02}
MOVING = """first, second = self.slopes(motion, states)
        return -0.5 * np.array([first, {0} * second])"""


def moving(mode):
    """Return a cord of which an own state does not rest where the energy is least in one mode."""
    text = TIGHTER.replace("return -0.5 * self.slopes(motion, states)", MOVING.format(mode))
    return text.replace("power(a, 2) + power(b, 2)", f"power(a, 2) + {mode} * power(b, 2)")


def nearly_convex(eps):
    """Return a cord with k ((D1 + D2)² - ε D2²) max(g, 0)²: not convex for any ε > 0."""
    squares = "states[0] * states[0] + 2 * states[0] * states[1] + states[1] * states[1]"
    strength = f"(1 + {squares} - {eps} * states[1]**2)"
    first = "2 * self.k * p * (states[0] + states[1])"
    second = f"2 * self.k * p * (states[0] + states[1] - {eps} * states[1])"
    text = TIGHTER.replace("(1 + power(states[0], 2))", strength)
    text = text.replace("2 * self.k * states[0] * p", first)
    return text.replace(
        "12 * states[1] - 4 * states[0]", f"12 * states[1] - 4 * states[0] + {second}"
    )


TURNING = element_text(
    """
    mode_count = 1

    def guards(self, motion, states):
        return np.array([motion.A[0, 2] - self.soft])

    def stored(self, motion, states):
        return self.mode[0] * self.k * motion.A[0, 1] * (motion.A[0, 2] - self.soft)

    def wrench(self, motion, states):
        row, g = motion.A[0], motion.A[0, 2] - self.soft
        by_second = np.array([row[2], 0.0, -row[0]])
        by_third = np.array([-row[1], row[0], 0.0])
        couple = row[1] * by_third + g * by_second
        return couple_on_body(-self.mode[0] * self.k * couple)
    """,
    'Gain("k", "N m", "couple", shape="number"), Gain("soft", "1", "place", shape="number")',
)
"""The energy k a b where b is positive, with entries a and b + soft of the rotation matrix."""

CODES: dict[str, tuple[str, dict[str, Any], str]] = {
    "an energy that jumps": (
        STIFF_GUARD.replace(SQUARE, f"{SQUARE} + self.mode[0]"),
        SOFT,
        switches.NOT_CONTINUOUS,
    ),
    "two modes at once": (
        STIFF_GUARD.replace(SQUARE, f"{SQUARE} + 0.0 * above + self.mode[0] * self.mode[1]"),
        SOFT,
        switches.NOT_CONTINUOUS,
    ),
    "the square of another function": (
        STIFF_GUARD.replace(
            "above, below = self.guards(motion, states)",
            "above, below = self.guards(motion, states) + np.array([0.1, 0.0])",
        ).replace(MODES, f"{MODES} + self.mode * np.array([0.1, 0.0])"),
        SOFT,
        switches.NOT_CONTINUOUS,
    ),
    "an event function by its mode": (
        STIFF_GUARD.replace(GUARDS, f"{GUARDS} + self.mode"),
        SOFT,
        switches.NOT_OF_ANGLES,
    ),
    "a mode in an exponential": (
        STIFF_GUARD.replace(SQUARE, "2.0 * exp(self.mode[0] * above)").replace(
            MODES, f"{MODES}\n        above = self.mode[0] * exp(self.mode[0] * above)"
        ),
        SOFT,
        switches.NOT_CONTINUOUS,
    ),
    "a wrench that is wrong in one mode": (
        STIFF_GUARD.replace("(above - below)", "(above - 1.01 * below)"),
        SOFT,
        passive.UNBALANCED,
    ),
    "a force with a sign that turns": (TURNING, {"k": 0.3, "soft": 0.3}, switches.SIGN_UNKNOWN),
    "a switch at an own state": (
        TIGHTER.replace("np.array([self.longer(motion)])", "np.array([states[0]])"),
        CORDS,
        switches.NOT_OF_ANGLES,
    ),
    "a jump by an own state": (
        TIGHTER.replace("power(self.longer(motion), 2)", "self.longer(motion)").replace(
            "g = self.mode[0] * self.longer(motion)", "g = 0.5 * self.mode[0]"
        ),
        CORDS,
        switches.JUMPS_BY_MORE,
    ),
    **{
        f"rest anywhere with {mode}": (moving(mode), CORDS, passive.NOT_RELAXING)
        for mode in ("self.mode[0]", "(1 - self.mode[0])")
    },
    **{
        f"less than convex by {eps}": (nearly_convex(eps), CORDS, passive.NOT_CONVEX_IN_STATES)
        for eps in (1e-20, 1e-12)
    },
    "two wells of an own state": (
        CORD.replace("15 * states[0] ** 2", "5 * (states[0] ** 2 - 0.01) ** 2").replace(
            "30 * states)", "20 * states * (states[0] ** 2 - 0.01))"
        ),
        CORDS,
        passive.NOT_CONVEX_IN_STATES,
    ),
    "an own state that nothing holds": (
        CORD.replace("(exp(x) - x - 1) + 15 * states[0] ** 2", "exp(x)")
        .replace("(exp(self.share(motion, states)) - 1)", "exp(self.share(motion, states))")
        .replace("- 30 * states)", "+ 0.0 * states)"),
        CORDS,
        passive.NO_LEAST_ENERGY,
    ),
}
"""Code, its parameters, and what of it is not shown."""


@pytest.mark.parametrize("name", CODES)
def test_code_that_is_not_shown_to_be_passive(name):
    text, values, reason = CODES[name]
    assert reason in (why_not_in_proofs(problem_of(with_code(text, **values)).system) or "")


def test_what_is_like_them_and_is_shown():
    as_a_square = STIFF_GUARD.replace(
        "0.5 * self.k * (self.mode[0] * above * above + self.mode[1] * power(below, 2))",
        "0.5 * self.k * power(self.mode[0] * above - self.mode[1] * below, 2)",
    )
    for text, values in (
        (nearly_convex(0.0), CORDS),
        (STIFF_GUARD, SOFT),
        (REPELLING_GUARD, SOFT),
        (as_a_square, None),
    ):
        why = why_not_in_proofs(problem_of(with_code(text, **(values or SOFT))).system)
        assert (why is None) == (values is not None)


POLE = element_text(
    """
    def wrench(self, motion, states):
        p = 30.0 * (motion.Theta[1] - self.s)
        return couple_on_body(30.0 * self.k / (1 + p * p) * motion.B[1])

    def stored(self, motion, states):
        return self.k * atan(1 / (30.0 * (motion.Theta[1] - self.s)))
    """,
    'Gain("k", "J", "k", shape="number"), Gain("s", "rad", "s", shape="number")',
)
"""Its wrench is smooth, but its energy jumps by kπ at θ2 = s."""

MAGNET = SPRING.replace(
    "-self.k * motion.X", "-self.k * exp(-(motion.X @ motion.X)) * motion.X"
).replace("0.5 * self.k * (motion.X @ motion.X)", "-0.5 * self.k * exp(-(motion.X @ motion.X))")

UNSEEN = SPRING + (
    "\n    def dissipated(self, motion, states):\n        return 1e-9 * sin(motion.Theta[0])\n"
)

ENDS: dict[str, Any] = {"point": [0.2, 0.1, 0.0], "anchor": [0.9, 0.1, 0.0]}
STRUT: dict[str, Any] = {"kind": "spring", **ENDS, "stiffness": 20.0, "rest_length": 0.1}
PUSH = {
    "kind": "input",
    "quantity": "couple",
    "direction": [1, 0, 0],
    "amplitude": 1,
    "signal": {"kind": "constant"},
}
POINT = TIE | {"point": [0.0, 0.0, 0.0], "anchor": [0.0, 0.0, 0.0]}
LIGAMENT = {"kind": "ligament", **ENDS, "slack_length": 0.3, "stiffness": 9.0, "toe_strain": 0.2}
STOPPED = {"kind": "guard", "method": "stop", "angle": 1.2, "restitution": 0.5}


def of(elements, controller=CONTROLLER, **changes):
    return load_config(config_data(elements, controller, **changes), allow_python=True)


def leg(variant, elements=(), **gains):
    """Return a leg on its knee; gains that are not given are zero."""
    tie_of_c = {"K_c": [4000, 4000, 40000], "L_c": [80, 80, 200]}
    controller = {"variant": variant, **(tie_of_c if variant == "visco-elastic" else {}), **gains}
    data = {"schema_version": 2, "body": BODY, "elements": dict(elements), "controller": controller}
    return load_config(data | {"integration": {"duration": 1.0}})


TURNS = {"K_r": [10, 10, 5], "L_r": [0.8, 0.8, 0.3]}
ALL = "no damper acts on the body (L_t is 0 and L_r is 0)"
NEAR = {"point": [0.15, 0.1, 0.58], "anchor": [1.15, 0.1, -0.42]}
TIE_OF_C = {"variant": "visco-elastic", "K_c": [9000.0] * 3, "L_c": [90.0] * 3}

CONFIGS: dict[str, tuple[Callable[[], Config], str]] = {
    "an element that supplies": (lambda: of({"push": PUSH}), SUPPLIES),
    "a tie that slides": (lambda: of({"tie": tie()}), "an element switches"),
    "code that is wrong": (
        lambda: with_code(SPRING.replace("0.5 * self.k", "0.6 * self.k"), k=3.0),
        "one: it is not shown that `wrench`",
    ),
    "an energy without a value": (
        lambda: with_code(POLE, k=3.0, s=0.5),
        "`stored`, `wrench` and `dissipated` have values",
    ),
    "a magnet of a free body": (
        lambda: with_code(MAGNET, "visco-elastic", k=30.0),
        "or convex in X",
    ),
    "a rope of a free body": (
        lambda: with_code(ROPE, "visco-elastic", k=0.5, **ENDS),
        "may be zero",
    ),
    "damping that is not seen": (lambda: with_code(UNSEEN, k=30.0), passive.UNBALANCED),
    "a floor under a free body": (
        lambda: with_code(FLOOR, "visco-elastic", k=3.0),
        switches.NOT_OF_ANGLES,
    ),
    "a jump beside a spring of a free body": (
        lambda: with_code(REPELLING_GUARD, "visco-elastic", others={"s": STRUT}, **SOFT),
        "its force jumps",
    ),
    "a jump beside an own state": (
        lambda: with_code(text_of(REPELLING), **CORDS),
        "its force jumps",
    ),
    "a spring that may have no length": (
        lambda: of({"s": STRUT | NEAR}, CONTROLLER | {"variant": "permanent"}),
        "no length",
    ),
    "a stop beside a spring of a tied body": (
        lambda: of({"s": STRUT, "range": STOPPED}, CONTROLLER | TIE_OF_C),
        "springs beside a stop",
    ),
    **{
        f"{' and '.join(elements) or 'nothing'}, {weight} m/s²": (
            partial(of, elements, None, gravity=[0, 0, weight]),
            NOT_DAMPED,
        )
        for elements in ({}, {"upright": UPRIGHT}, {"tie": TIE}, {"tie": TIE, "other": POINT})
        for weight in (-9.81, 0.0)
    },
    "a tie beside a ligament": (lambda: of({"tie": TIE, "cord": LIGAMENT}, None), NOT_DAMPED),
    "a held leg": (lambda: leg("permanent"), ALL),
    "a leg that may be anywhere": (
        lambda: leg("free", **TURNS, L_t=[1, 1, 1]),
        "nothing holds the position",
    ),
    "a leg that may turn freely": (
        lambda: leg("permanent", L_r=[1, 1, 1], K_r=[10, 10, 0]),
        "a continuum (a family) of rest states",
    ),
}
"""Configs of which nothing is proved, and words of the reason."""


@pytest.mark.parametrize("name", CONFIGS)
def test_nothing_is_proved_and_the_reason_is_named(name):
    config, words = CONFIGS[name][0](), CONFIGS[name][1]
    proof = prove(config, brief=True)
    assert words in proof.ended
    assert (proof.proved, proof.unique, proof.every_start) == (False, None, False)
    assert proof.region is None or not proof.region.proved
    if "supplies" not in name:
        enclosed = prove_convergence(config, problem_of(config), proof, Enclose.BRIEFLY)
        assert enclosed.convergence.proved is None


@pytest.mark.parametrize(
    "name", ["a magnet of a free body", "a rope of a free body", "damping that is not seen"]
)
def test_rest_states_are_searched_where_nothing_is_proved(name):
    """The lowest is scipy's minimum of the energy."""
    config = CONFIGS[name][0]()
    proof = prove(config)
    assert proof.claims_nothing
    at_rest = configurations(problem_of(config).system)
    least = minimize(at_rest.energy, at_rest.unloaded, jac=at_rest.gradient, tol=1e-13)
    state = proof.states[0]
    coordinates = [*state.orientation, *([] if at_rest.held else state.position)]
    np.testing.assert_allclose(coordinates, least.x, atol=1e-5)
    assert not state.proved


@pytest.mark.parametrize("declared", [False, True])
def test_a_run_tells_of_a_class_that_does_not_declare_its_kinks(declared):
    """Declared, the search finds the state that is held: v is never below zero."""
    values: dict[str, Any] = {"point": [0.1, 0.2, -0.1], "anchor": [0.3, 0.3, 1.1]}
    values |= {"k": 3.0, "length": 1.48}
    text = WEIGHT.replace("mode_count = 1", "mode_count = 1\n    kinked = True")
    result = simulate(with_code(text if declared else WEIGHT, **values))
    assert ("`kinked = True`" in str(result.attributes["warnings"])) is not declared
    if declared:
        assert np.all(np.asarray(result["lyapunov"]) >= -1e-12)
        (state,) = prove(with_code(text, "visco-elastic", **values)).states
        assert (state.held, state.proved) == (True, False)


def test_without_permission_no_code_runs():
    config = with_code(SPRING, k=3.0)
    proof, read = prove(config), config_to_read(config.plain())
    refused = prove(read)
    assert (refused.states, refused.outcome) == ((), CODE_NOT_RUN)
    assert any(CODE_NOT_RUN in text for text in verify(proof, read).unchecked)


def test_a_formula_of_an_angle_itself_has_no_wider_range():
    """It is not periodic, so its values at other turns are others."""
    text = element_text("""
        def wrench(self, motion, states):
            return couple_on_body(-self.k * np.array([tanh(motion.Theta[0]), 0.0, 0.0]) @ motion.B)

        def stored(self, motion, states):
            return self.k * log(cosh(motion.Theta[0]))
        """)
    proof = prove(with_code(text, k=3.0))
    assert proof.proved
    assert proof.unwrapped is None
