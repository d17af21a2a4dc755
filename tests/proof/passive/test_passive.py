"""Protects what is shown of elements of users: their power balance, for all states, or nothing."""

import pytest
from support.user_code import element_text, loaded_with, python_section

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.proof.passive import passive
from rbstab.proof.passive.passive import why_not_in_proofs, why_not_passive
from rbstab.proof.passive.statements import statements_of

AT_POINT = {"point": [0.3, 0.2, 0.1], "anchor": [0.3, 0.2, 0.1], "k": 30.0, "c": 2.0}


def statements(wrench, stored, dissipated="0.0"):
    """Return the text of an element at a point; e and f are its displacement and velocity."""
    begin = "e, f = position(motion, self.point) - self.anchor, velocity(motion, self.point)"
    return element_text(
        f"""
        def wrench(self, motion, states):
            {begin}
            return force_at(motion, self.point, {wrench})

        def stored(self, motion, states):
            {begin}
            return {stored}

        def dissipated(self, motion, states):
            {begin}
            return {dissipated}
        """,
        'POINT, ANCHOR, Gain("k", "N/m", "k", shape="number"), '
        'Gain("c", "N s/m", "c", shape="number", positive=False)',
    )


def statements_in(folder, text, **parameters):
    (folder / "mine.py").write_text(text)
    problem = problem_of(loaded_with({"one": python_section(**(parameters or AT_POINT))}))
    at_rest = configurations(problem.system)
    (element,) = (candidate for candidate in at_rest.system.elements if candidate.from_user)
    return statements_of(at_rest, element)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


SPRING = "-self.k * e", "0.5 * self.k * (e @ e)"


def damped(force, power=None):
    """Return a spring beside a damper."""
    return f"{SPRING[0]} - {force}", SPRING[1], power or f"f @ ({force})"


CASES = {
    "a root of a constant": (("-e / sqrt(self.k)", "0.5 / sqrt(self.k) * (e @ e)"), None),
    "a root": (("-self.k * e / sqrt(1 + e @ e)", "self.k * sqrt(1 + e @ e)"), None),
    "other functions": (
        (
            "-self.k * (sinh(e) + cosh(e) - sin(e) + cos(e))",
            "self.k * (cosh(e) + sinh(e) + cos(e) + sin(e)).sum()",
        ),
        None,
    ),
    "inverse functions": (
        (
            "-self.k * (1 / (1 + e * e) + (1 + tan(e) * tan(e)))",
            "self.k * (atan(e) + tan(e)).sum()",
        ),
        None,
    ),
    "cubic damping": (damped("self.c * (f @ f) * f"), None),
    "a saturating damper": (damped("self.c * f / sqrt(0.01 + f @ f)"), None),
    "a quotient by the attitude": (
        damped("self.c * f / (2 + motion.A[0][0])"),
        passive.GAINS_ENERGY,
    ),
    "a logarithm": (damped("self.c * f * log(2 + f @ f)"), passive.GAINS_ENERGY),
    "a root of another constant": (("-sqrt(self.k) * e", SPRING[1]), passive.UNBALANCED),
    "the factor": (("-self.k * e", "0.499999 * self.k * (e @ e)"), passive.UNBALANCED),
    "the damping": (damped("self.c * f", "2 * self.c * f @ f"), passive.UNBALANCED),
    "a root of the other sign": (
        (SPRING[0], f"{SPRING[1]} + sqrt(e[0] * e[0]) - e[0]"),
        passive.UNBALANCED,
    ),
    "a damper that drives": (damped("-self.c * f"), passive.GAINS_ENERGY),
    "an indefinite gain": (damped("(self.c - 2.01) * f"), passive.GAINS_ENERGY),
    "an energy of the velocity": ((SPRING[0], f"{SPRING[1]} + f @ f"), passive.NO_FUNCTION_OF_POSE),
    "the time": (tuple(f"{part} * motion.time" for part in SPRING), passive.TIMED),
    "dry friction": (damped("self.c * f / sqrt(f @ f)"), passive.WITHOUT_VALUES),
    "a length that may be zero": (damped("self.c * f / (e @ e)"), passive.WITHOUT_VALUES),
    "a tangent of a rate": (
        damped("self.c * f * tan(motion.Omega[0]) * tan(motion.Omega[0])"),
        passive.WITHOUT_VALUES,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_shown_of_an_element(folder, name):
    """Where the sign of a factor is not seen, nothing is said of the dissipation."""
    parts, why = CASES[name]
    assert why_not_passive(statements_in(folder, statements(*parts))) == why


HALVES = """
mode_count = 1

def guards(self, motion, states):
    return np.array([motion.Theta[1] - 0.1])

def wrench(self, motion, states):
    above = motion.Theta[1] - 0.1
    return couple_on_body(-self.k * (FACTOR) * above * motion.B[1])

def stored(self, motion, states):
    above = motion.Theta[1] - 0.1
    return 0.5 * self.k * (FACTOR) * above * above
"""

FACTORS = {
    "both sides": ("self.mode[0]", None),
    "a divisor that is zero with one of its values": ("1 / self.mode[0]", passive.WITHOUT_VALUES),
}


@pytest.mark.parametrize("name", FACTORS)
def test_an_element_is_passive_with_all_values_of_its_modes(folder, name):
    factor, why = FACTORS[name]
    text = element_text(HALVES.replace("FACTOR", factor))
    assert why_not_passive(statements_in(folder, text, k=3.0)) == why
    wrong = text.replace("couple_on_body(-self.k", "couple_on_body(-(1 - self.mode[0]) * self.k")
    assert why_not_passive(statements_in(folder, wrong, k=3.0)) is not None


@pytest.mark.parametrize("stiffness", [0.0, 1.0, -1.0])
def test_a_part_that_is_convex_does_not_hide_one_that_is_not(folder, stiffness):
    """Of a free body: x⁴ and a spring of either sign, each term by itself."""
    text = statements(
        f"-4 * power(e, 3) - ({stiffness}) * e",
        f"power(e, 4).sum() + 0.5 * ({stiffness}) * (e @ e)",
    )
    (folder / "mine.py").write_text(text)
    config = loaded_with({"one": python_section(**AT_POINT)}, "visco-elastic")
    why = why_not_in_proofs(problem_of(config).system)
    assert (why is None) is (stiffness >= 0)
    assert why is None or passive.NOT_CONVEX in why
