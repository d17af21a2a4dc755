"""Protects reading what a class of a user declares: from its text alone, which never runs."""

import re

import pytest
from support.user_code import element_text, traitor

from rbstab.elements.declarations import ANCHOR, POINT, Gain, OwnState
from rbstab.elements.user_code.declared import (
    MAX_GAINS,
    MAX_STATES,
    DeclarationError,
    classes_of,
    declared,
)
from rbstab.elements.user_code.template import TEMPLATE


def of(gains, rest="pass"):
    return declared(f"class Mine(Element):\n    gains = {gains}\n    {rest}\n", "Mine")


def test_every_form_of_a_declaration():
    declaration = of(
        '(POINT, ANCHOR, elements.Gain("c", "N s/m", "c", "number", default=0),'
        ' Gain(name="K", unit="N/m", description="K", positive=False, below=None))',
        "mode_count: ClassVar[int] = 2",
    )
    assert declaration.gains[:2] == (POINT, ANCHOR)
    assert declaration.gains[2] == Gain("c", "N s/m", "c", "number", default=0)
    assert declaration.gains[3] == Gain("K", "N/m", "K", positive=False)
    assert declaration.mode_count == 2
    assert declared(TEMPLATE, "CubicSpring").gains[0].shape == "diagonal"


def test_gains_of_a_base_in_the_same_file():
    assert declared("class A(B):\n    pass\nclass B(A):\n    pass\n", "A").gains == ()
    text = (
        'class A(Element):\n    gains = (Gain("a", "N", "a"),)\n    mode_count = 1\n'
        'class B(A):\n    gains = (Gain("b", "N", "b"),)\nclass C(Other, B):\n    pass\n'
    )
    assert [gain.name for gain in declared(text, "B").gains] == ["b"]
    assert [gain.name for gain in declared(text, "C").gains] == ["b"]
    assert declared(text, "C").mode_count == 1


def test_supplied_power():
    text = (
        "class A(Element):\n    def stored(self): ...\n"
        "class B(A):\n    def supplied(self, motion, states): ...\nclass C(B):\n    pass\n"
    )
    assert [declared(text, name).supplies for name in "ABC"] == [False, True, True]


def test_nothing_runs(tmp_path):
    marker = tmp_path / "ran"
    text = traitor(marker)
    assert [gain.name for gain in declared(text, "Mine").gains] == ["k"]
    assert list(classes_of(text)) == ["Mine"]
    assert not marker.exists()


@pytest.mark.parametrize(
    "argument", ["open('ran', 'w').name", "__import__('os').name", "NAME", "f'{1}'", "*'ab'"]
)
def test_arguments_are_constants(argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DeclarationError, match=r"line 2: .*not plain texts, numbers"):
        of(f'(Gain({argument}, "N", "meaning"),)')
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("gains", "problem"),
    [
        ("GAINS", "no tuple"),
        ("(k,)", "cannot be read as Gain without running"),
        ("(*OTHERS,)", "cannot be read as Gain without running"),
        ("(gain('k'),)", "cannot be read as Gain without running"),
        ("(Gain('k'),)", "not plain texts, numbers"),
        ("(Gain('k', 'N', 'k', colour='red'),)", "not plain texts, numbers"),
        ("(Gain('k', 'N', 'k'), Gain('k', 'm', 'k'))", "two gains of the same name"),
        *(
            (f"(Gain({name!r}, 'N', 'k'),)", "Gain whose name is wrong")
            for name in ("1k", "_k", "class", "name", "wrench", "holds", "initial_s", 5)
        ),
        ("(Gain('k', 7, 'k'),)", "Gain whose unit is wrong"),
        ("(Gain('k', 'N\\n', 'k'),)", "Gain whose unit is wrong"),
        ("(Gain('k', 'N', None),)", "Gain whose description is wrong"),
        ("(Gain('k', 'N', 'k', shape='vector'),)", "Gain whose shape is wrong"),
        ("(Gain('k', 'N', 'k', positive=1),)", "Gain whose positive is wrong"),
        ("(Gain('k', 'N', 'k', default=1.0),)", "are for a number only"),
        ("(Gain('k', 'N', 'k', 'diagonal', at_most=1.0),)", "are for a number only"),
        ("(Gain('k', 'N', 'k', 'diagonal', or_zero=True),)", "are for a number only"),
        ("(Gain('k', 'N', 'k', 'number', default=-1.0),)", "Gain whose default is wrong"),
        ("(Gain('k', 'N', 'k', 'number', default=1e999),)", "Gain whose default is wrong"),
        ("(Gain('k', 'N', 'k', 'number', below=True),)", "Gain whose below is wrong"),
        ("(Gain('k', 'N', 'k', 'number', at_most='1'),)", "Gain whose at_most is wrong"),
        ("(Gain('d', '1', 'd', 'direction', positive=False),)", "a direction has no `positive`"),
        ("(" + "POINT, " * (MAX_GAINS + 1) + ")", f"has {MAX_GAINS + 1} gains"),
    ],
)
def test_wrong_gains(gains, problem):
    with pytest.raises(DeclarationError, match=re.escape(problem)) as caught:
        of(gains)
    assert caught.value.line == 2


@pytest.mark.parametrize("count", ["-1", "True", "1.0", "COUNT", "1000"])
def test_wrong_numbers_of_modes(count):
    with pytest.raises(DeclarationError, match="mode_count"):
        declared(f"class Mine(Element):\n    mode_count = {count}\n", "Mine")


def test_own_states():
    declaration = of(
        "()", "states = (OwnState('s', 'σ', 'm', 'a', 2), elements.OwnState('t', 't', '1', 'b'))"
    )
    assert declaration.states == (OwnState("s", "σ", "m", "a", 2), OwnState("t", "t", "1", "b"))
    assert of("()").states == ()


@pytest.mark.parametrize(
    ("states", "problem"),
    [
        ("STATES", "has states that are no tuple"),
        ("(s,)", "cannot be read as OwnState without running"),
        ("(Gain('s', 'm', 'm'),)", "cannot be read as OwnState without running"),
        ("(OwnState('s'),)", "OwnState(...) whose arguments are not plain"),
        ("(OwnState('S', 's', 'm', 'm'),)", "OwnState whose name is wrong"),
        ("(OwnState('a.b', 's', 'm', 'm'),)", "OwnState whose name is wrong"),
        *(
            (f"(OwnState('s', 's', 'm', 'm', {size}),)", "OwnState whose size is wrong")
            for size in (0, True, 1000)
        ),
        ("(OwnState('s', 's\\n', 'm', 'm'),)", "OwnState whose symbol is wrong"),
        ("(OwnState('s', 's', 5, 'm'),)", "OwnState whose unit is wrong"),
        ("(OwnState('s', 's', 'm', 'm'), OwnState('s', 't', 'm', 'm'))", "two states of the same"),
        (f"({'s, ' * (MAX_STATES + 1)})", f"has {MAX_STATES + 1} states"),
    ],
)
def test_wrong_own_states(states, problem):
    with pytest.raises(DeclarationError, match=re.escape(problem)) as caught:
        of("()", f"states = {states}")
    assert caught.value.line == 3


def test_another_class():
    with pytest.raises(DeclarationError, match="not a class of the file") as caught:
        declared(element_text("def wrench(self, motion, states): ..."), "Yours")
    assert caught.value.expected == "expected one of its own: Mine"


SYNTAX = "x = 1\ny = 2\nclass 5:\n"


@pytest.mark.parametrize(
    "text", [SYNTAX, "\0", "(" * 50_000, "-" * 90_000 + "1", "x = 1\n\tif y:\n"]
)
def test_what_is_not_python(text):
    with pytest.raises(DeclarationError, match="is not Python") as caught:
        declared(text, "Mine")
    assert caught.value.line == text.count("\n") or text != SYNTAX
