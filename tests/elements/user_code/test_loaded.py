"""Protects running the file of a user: once, as a frozen dataclass; its errors name a line."""

import pickle
import sys
from typing import Any

import numpy as np
import pytest
from support.user_code import SPRING, element_text

from rbstab.elements.element import Element
from rbstab.elements.user_code.loaded import (
    UserCode,
    UserCodeError,
    element_class,
    element_classes,
    failure,
    failure_in_user_code,
    module_of,
)
from rbstab.elements.user_code.template import TEMPLATE
from rbstab.mechanics.algebra import IDENTITY, ZERO
from rbstab.mechanics.motion import Motion

MOTION = Motion(ZERO, ZERO, np.array([1.0, 2.0, -1.0]), ZERO, IDENTITY, IDENTITY, ZERO, ZERO)


def loaded(text, name="Mine"):
    return element_class(UserCode(text, "mine.py"), name)


def test_the_template_in_closed_form():
    kind = loaded(TEMPLATE, "CubicSpring")
    element = kind(name="mine", k=np.array([1.0, 2.0, 3.0]))
    wrench = element.wrench(MOTION, np.zeros(0))
    np.testing.assert_array_equal(wrench.force, [-1.0, -16.0, 3.0])
    assert element.stored(MOTION, np.zeros(0)) == (1 * 1 + 2 * 16 + 3 * 1) / 4
    assert element.dissipated(MOTION, np.zeros(0)) == 0.0
    assert kind.from_user
    assert not Element.from_user


def test_a_file_runs_once_for_a_process():
    code = UserCode("RUNS = []\n" + SPRING, "mine.py")
    assert module_of(code) is module_of(UserCode(code.source, "mine.py"))
    assert element_class(code, "Mine") is element_class(code, "Mine")
    assert module_of(code) is not module_of(UserCode(SPRING, "mine.py"))


def test_a_dataclass_of_the_user():
    text = SPRING.replace(
        "class Mine(Element):",
        "from dataclasses import dataclass\nfrom typing import Any, ClassVar\n\n"
        "@dataclass(frozen=True, eq=False, kw_only=True)\nclass Mine(Element):",
    ).replace("    gains =", "    name: str\n    k: Any\n    gains: ClassVar =")
    assert loaded(text)(name="mine", k=2.0).k == 2.0
    with pytest.raises(UserCodeError, match="other fields than name, k"):
        loaded(text.replace("k: Any", "k: Any\n    c: Any"))


def test_classes_of_a_file_with_a_base():
    text = (
        SPRING + "\n\nclass Twice(Mine):\n    def stored(self, motion, states):\n        return 2\n"
    )
    text += "\n\nclass NoWrench(Element):\n    pass\n"
    kinds: list[Any] = list(element_classes(UserCode(text, "mine.py")))
    assert [kind.__name__ for kind in kinds] == ["Mine", "Twice"]
    assert kinds[1](name="mine", k=1.0).stored(MOTION, np.zeros(0)) == 2


def test_an_element_gets_to_another_process():
    """There, no module of this name has run: it is run from the text that comes along."""
    code = UserCode(SPRING + "# for another process\n", "mine.py")
    kind: Any = element_class(code, "Mine")
    sent = pickle.dumps(kind(name="mine", k=np.array(2.0)))
    del sys.modules[module_of(code).__name__]
    module_of.cache_clear()
    element_class.cache_clear()
    received = pickle.loads(sent)  # noqa: S301 (made above)
    assert (received.name, float(received.k)) == ("mine", 2.0)
    np.testing.assert_array_equal(received.wrench(MOTION, ()).force, -2.0 * MOTION.X)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("import no_such_module\n", r"line 1: ModuleNotFoundError: No module named 'no_such"),
        ("\n\nraise ValueError\n", "line 3: ValueError: no message"),
        ("import sys\nsys.exit(3)\n", "line 2: SystemExit: 3"),
        ("x = 1\ndef f():\n    return 1 / 0\nf()\n", "line 3: ZeroDivisionError"),
        ("return 5\n", "line 1: SyntaxError: 'return' outside function"),
    ],
)
def test_a_file_that_cannot_run(text, problem):
    text += "class Mine:\n    pass\n"
    for _ in range(2):  # the second time as the first
        with pytest.raises(UserCodeError, match=f"cannot be run: {problem}"):
            loaded(text)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("class Mine:\n    pass\n", "not a class derived from rbstab.elements.Element"),
        (SPRING + "\nMine = 5\n", "not a class derived from rbstab.elements.Element"),
        (SPRING + "\nMine.gains = ()\n", "has other gains, modes or states"),
        (SPRING + "\nMine.mode_count = 1\n", "has other gains, modes or states"),
        (SPRING + "\nMine.states = (5,)\n", "has other gains, modes or states"),
        (
            "from rbstab.elements.spring import Spring\nclass Mine(Spring):\n    pass\n",
            "has other gains, modes or states",
        ),
    ],
)
def test_what_is_not_the_class_that_was_read(text, problem):
    with pytest.raises(UserCodeError, match=problem):
        loaded(text)


@pytest.mark.parametrize(
    ("statement", "name"),
    [
        ("def supplied(self, motion, states): return 1.0", "supplied"),
        ("holds = True", "holds"),
        ("slides = True", "slides"),
        ("timed = True", "timed"),
    ],
)
def test_what_only_elements_of_the_program_state(statement, name):
    """Such a class would need a hold, equivalent forces or the time; it would silently get none."""
    text = SPRING.rstrip() + f"\n\n    {statement}\n"
    with pytest.raises(UserCodeError, match=f"states `{name}`, which no element of a user can"):
        loaded(text)


def test_the_line_of_an_error():
    code = UserCode(
        element_text("def wrench(self, motion, states):\n    return motion.Y\n"), "mine.py"
    )
    line = 1 + next(i for i, text in enumerate(code.source.splitlines()) if "motion.Y" in text)
    kind: Any = element_class(code, "Mine")
    with pytest.raises(AttributeError) as caught:
        kind(name="mine", k=1.0).wrench(MOTION, ())
    text = "AttributeError: 'Motion' object has no attribute 'Y'"
    assert failure(code, caught.value) == f"line {line}: {text}"
    assert failure_in_user_code(caught.value) == f"mine.py: line {line}: {text}"
    assert failure_in_user_code(ValueError("ours")) is None
