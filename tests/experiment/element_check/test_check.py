"""Protects `rbstab check --element`: right elements pass, and a wrong statement is named.

The program's own elements are right by other tests, so each of them must pass. Each wrong element
below has one fault; the check must name the statement that has it, and the state.
"""

from pathlib import Path

import pytest
from support import missing_heyoka
from support.user_code import CREEPING_TIE, HEAD, MAXWELL, ROPE, SPRING, element_text

from rbstab.elements.registry import NAMED_ELEMENTS
from rbstab.elements.sliding import SlidingTie
from rbstab.elements.user_code.loaded import UserCode, element_class
from rbstab.elements.user_code.template import TEMPLATE
from rbstab.experiment.element_check import check
from rbstab.experiment.element_check.check import (
    AT_REST,
    IN_MOTION,
    ElementFileError,
    check_class,
    check_file,
)


@pytest.fixture(autouse=True)
def _few_states(monkeypatch):
    monkeypatch.setattr(check, "STATES", 10)
    monkeypatch.setattr(check, "BALL_STATES", 3)


NO_CODE = UserCode("", "ours.py")

STORED = "def stored(self, motion, states):\n    return 0.5 * self.k * (motion.X @ motion.X)\n"

DAMPER = """
def wrench(self, motion, states):
    return force_at_centre(-self.k * motion.V)
def dissipated(self, motion, states):
    return self.k * (motion.V @ motion.V)
"""

CREEPING = CREEPING_TIE.read_text(encoding="utf-8").replace("CreepingTie", "Mine")


def of(text, name="Mine"):
    code = UserCode(text, "mine.py")
    return check_class(element_class(code, name), code)


def force(formula, rest=STORED):
    return element_text(
        f"def wrench(self, motion, states):\n    return force_at_centre({formula})\n{rest}"
    )


OF_THE_MOTION = [
    kind
    for kind in NAMED_ELEMENTS
    if not (kind.states or kind.supplies or kind.holds or issubclass(kind, SlidingTie))
]
"""The elements of the program that are as those of users: passive, and functions of the motion."""


@pytest.mark.parametrize("kind", OF_THE_MOTION, ids=lambda kind: kind.__name__)
def test_every_element_of_the_program_passes(kind):
    checked = check_class(kind, NO_CODE)
    assert checked.problems == ()
    assert AT_REST in checked.passed
    assert IN_MOTION in checked.passed
    assert len(checked.passed) == 8 + 2 * bool(kind.mode_count) + kind.kinked


RIGHT = {
    "template": TEMPLATE.replace("CubicSpring", "Mine"),
    "spring": SPRING,
    "damper": element_text(DAMPER),
    "ligament": ROPE,
    "exponential": element_text("""
        def wrench(self, motion, states):
            return force_at_centre(-self.k * exp(motion.X))

        def stored(self, motion, states):
            return self.k * exp(motion.X).sum()
        """),
    "contact": element_text("""
        def wrench(self, motion, states):
            return force_at_contact(-self.k * motion.E - self.k * motion.F)

        def stored(self, motion, states):
            return 0.5 * self.k * (motion.E @ motion.E)

        def dissipated(self, motion, states):
            return self.k * (motion.F @ motion.F)
        """),
    "couple": element_text("""
        def wrench(self, motion, states):
            down = np.array([0.0, 0.0, 1.0])
            return couple_on_body(self.k * cross(down, motion.A.T @ down))

        def stored(self, motion, states):
            return -self.k * motion.A[2, 2]
        """),
    "own states": CREEPING,
    "one own state": MAXWELL,
}


@pytest.mark.parametrize("name", RIGHT)
def test_right_elements_of_users(name):
    checked = of(RIGHT[name])
    assert checked.problems == ()
    assert "heyoka's expressions pass" in checked.passed
    (note,) = checked.notes
    assert note.startswith(NOTES.get(name, "proofs take it into account"))
    assert name in NOTES or note == "proofs take it into account"


HELD = "proofs of a held body take it into account, those of other bodies do not: "

NOTES = {
    "ligament": f"{HELD}it is not shown that `stored`, `wrench` and `dissipated` have",
    "one own state": f"{HELD}it is not shown that `stored`, `wrench` and `dissipated` have",
}


WRONG = {
    "time": (
        force("-self.k * motion.X * (1 + motion.time)"),
        "`wrench` depends on `motion.time`; only inputs of the program may",
    ),
    "sign": (force("self.k * motion.X"), "the wrench on a body at rest is not the slope"),
    "dropped axis": (
        force("-self.k * motion.X * np.array([1, 1, 0])"),
        "with a velocity of 1 m/s along the inertial axis z",
    ),
    "frame of a couple": (
        RIGHT["couple"].replace("self.k * cross(", "motion.A @ cross(self.k * "),
        "with a turn of 1 rad/s about the body axis",
    ),
    "half of the power": (
        element_text(DAMPER.replace("return self.k * (", "return 0.5 * self.k * (")),
        "`dissipated` is not the power that `wrench` takes",
    ),
    "active": (
        element_text(DAMPER.replace("-self.k", "self.k").replace("return self", "return -self")),
        "`dissipated` is negative",
    ),
    "kinetic": (
        force(
            "0 * motion.X",
            "def stored(self, motion, states):\n    return motion.V @ motion.V\n",
        ),
        "`stored` depends on the velocity V",
    ),
    "branch": (
        force("-self.k * (motion.X if motion.X[0] > 0 else motion.X)"),
        "heyoka's expressions fail (it compares values, as max does; a force with a corner needs "
        "an element that switches, with `mode_count` and `guards`)",
    ),
    "numpy's exp": (
        RIGHT["exponential"].replace(" exp(", " np.exp("),
        "use sin, cos, tan, atan, sqrt, exp, log, sinh, cosh, tanh and power of rbstab.elements",
    ),
    "power of heyoka": (
        force("-self.k * motion.X**3", STORED.replace("motion.X)", "motion.X**3) / 2")),
        "heyoka cannot start where X = 0",
    ),
    "not analytic": (
        force("-self.k * np.abs(motion.X)", STORED.replace("@ motion.X)", "@ np.abs(motion.X))")),
        "the slope by a complex step is not that of differences",
    ),
    "only for doubles": (
        force("-self.k * np.array([x if hasattr(x, 'dtype') else 2 * x for x in motion.X])"),
        "give other values than floats",
    ),
    "infinite": (force("-self.k * motion.X / 0.0"), "`wrench` is not finite"),
    "an error": (force("-self.c * motion.X"), "line 12: AttributeError: 'Mine' object has no"),
    "guards by mode": (
        ROPE.replace("length - self.k])", "length - self.k * (1 + self.mode[0])])"),
        "`guards` depends on `mode`",
    ),
    "guards by velocity": (
        ROPE.replace("length - self.k])", "rate])"),
        "`guards` depends on velocities",
    ),
    "jump of the energy": (
        ROPE.replace("extension * extension", "(extension * extension + 0.1)"),
        "`stored` jumps where event function 1 is 0",
    ),
    "sign of a rate": (
        CREEPING.replace(" - self.K_d @ states) / self.L_d", " + self.K_d @ states) / self.L_d"),
        "`dissipated` is not the power that `wrench` takes from the motion, or `rates` is wrong",
    ),
    "rate by time": (
        CREEPING.replace("/ self.L_d\n", "/ self.L_d * (1 + motion.time)\n"),
        "`rates` depends",
    ),
    "kinked with the square of a mode": (
        ROPE.replace("0.5 * self.mode[0]", "0.5 * self.mode[0] * self.mode[0]").replace(
            "mode_count = 1", "mode_count = 1\n    kinked = True"
        ),
        "`stored` is not linear in `mode[0]`",
    ),
    "guards by own states": (
        MAXWELL.replace(
            "    def rates",
            "    mode_count = 1\n\n    def guards(self, motion, states):\n"
            "        return np.array([states[0] - 0.1])\n\n    def rates",
        ),
        "`guards` depends on own states",
    ),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:Casting complex values")
@pytest.mark.parametrize("name", WRONG)
def test_the_wrong_statement_is_named(name):
    text, expected = WRONG[name]
    assert text not in RIGHT.values()
    checked = of(text)
    assert any(expected in problem for problem in checked.problems), checked.problems


@pytest.mark.parametrize("name", ["sign", "active", "jump of the energy", "half of the power"])
def test_no_other_statement_is_blamed(name):
    (problem,) = of(WRONG[name][0]).problems
    assert "state " in problem
    assert "X = [" in problem
    assert "k = " in problem


@missing_heyoka.NEEDED
def test_slow_elements_have_a_note():
    """numpy evaluates what Python code of single numbers cannot: here, a fractional power."""
    checked = of(
        force(
            "-self.k * motion.X * (1 + motion.X @ motion.X) ** 0.5",
            "def stored(self, motion, states):\n"
            "    return self.k * (1 + motion.X @ motion.X) ** 1.5 / 3\n",
        )
    )
    assert checked.problems == ()
    slow, no_proof = checked.notes
    assert "15 times slower" in slow
    assert no_proof.startswith("no proof takes it into account: its code cannot be recorded: ")


@missing_heyoka.NEEDED
def test_a_force_that_jumps_has_a_note_unless_the_class_says_so():
    text = (Path(__file__).parents[3] / "configs" / "examples" / "counterweight.py").read_text()
    checked = of(text.replace("class Counterweight", "class Mine"))
    assert checked.problems == ()
    assert "`stored` is linear in each mode, as `kinked` says" in checked.passed
    assert len(checked.notes) == 1
    silent = of(text.replace("class Counterweight", "class Mine").replace("kinked = True", ""))
    assert silent.problems == ()
    assert silent.notes[0].startswith("its force jumps at a switch: declare `kinked = True`")
    assert silent.notes[1:] == checked.notes


STEP = element_text("""
    mode_count = 1

    def guards(self, motion, states):
        return np.array([motion.X[2] - self.k])

    def wrench(self, motion, states):
        return force_at_centre(np.array([0.0, 0.0, -3.0 * self.mode[0]]))

    def stored(self, motion, states):
        return 3.0 * self.mode[0] * (motion.X[2] - self.k)
    """)
"""A constant force above a height. Its energy is zero at the switch, but for round-off."""


def test_an_energy_that_is_zero_at_the_switch_does_not_jump_there():
    checked = of(STEP)
    assert checked.problems == ()
    higher = of(STEP.replace("(motion.X[2] - self.k)", "(motion.X[2] - self.k + 1e-6)"))
    assert "`stored` jumps where event function 1 is 0" in higher.problems[0]


def test_a_switch_that_no_states_have_between_them_has_a_note():
    checked = of(STEP.replace("motion.X[2] - self.k", "motion.X[2] - 1e3 * self.k"))
    assert checked.problems == ()
    assert checked.notes[0].startswith("event function 1 has one sign at all these states")
    assert not any("has one sign" in note for note in of(STEP).notes)


def test_every_class_of_a_file_is_checked(tmp_path):
    path = tmp_path / "mine.py"
    wrong = "\n\nclass Wrong(Mine):\n    def stored(self, motion, states):\n        return 0.0\n"
    path.write_text(SPRING + wrong)
    good, bad = check_file(path)
    assert (good.name, good.problems) == ("Mine", ())
    assert bad.name == "Wrong"
    assert "is not the slope of `stored`" in bad.problems[0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (HEAD, "has no class derived from rbstab.elements.Element with a wrench"),
        ("class Mine(:\n", "cannot be run: line 1: SyntaxError"),
        ("1 / 0\n", "cannot be run: line 1: ZeroDivisionError"),
        (SPRING.replace('Gain("k"', "Gain(str('k')"), "not plain texts, numbers"),
    ],
)
def test_files_that_have_no_element(tmp_path, text, expected):
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(ElementFileError) as caught:
        check_file(path)
    assert expected in str(caught.value)
