"""Protects `kind: python` in configs: refused unless allowed, its text part of the config."""

import pickle
from itertools import product
from typing import Any

import pytest
from support.inputs import SINE, force
from support.switching import data
from support.user_code import SPRING, element_text, python_section, traitor

from rbstab.config.build import problem_of, supplies_power, system_of
from rbstab.config.errors import ConfigError
from rbstab.config.load import (
    changed_config,
    config_to_read,
    load_config,
    resolved,
    resolved_yaml,
    run_id,
    source_of,
    validated,
)
from rbstab.config.numbers import entries_of
from rbstab.config.units import unit_of
from rbstab.config.user_code.permission import (
    CodeNotAllowedError,
    has_code,
    may_run_code,
    without_code,
)
from rbstab.elements.user_code.declared import MAX_SOURCE, sha256

TEXT = """\
schema_version: 2
body: {mass: 2, inertia: [1, 1, 1], contact_point: [0, 0, 0]}
elements:
  mine:
    kind: python
    file: parts/mine.py
    class: Mine
    parameters: {k: 3}
integration: {duration: 1, samples: 3}
"""

SHAPES = """\
Gain("a", "N", "a", shape="number"), Gain("b", "N", "b", shape="diagonal"),
    Gain("copy", "N", "c"), Gain("d", "N", "d", "number", positive=False),
    Gain("e", "N", "e", "number", default=0.5), Gain("f", "1", "f", "number", below=1.0), POINT"""

SHAPED = element_text(
    "def wrench(self, motion, states):\n    return force_at_centre(0 * motion.X)", SHAPES
)

VALUES = {"a": 1, "b": [1, 2, 3], "copy": [4, 5, 6], "d": -1, "f": 0.5, "point": [0, -1, 0]}


@pytest.fixture
def code(tmp_path, monkeypatch):
    """The file of an element; a config beside its folder, `case.yaml`, names it."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "parts" / "mine.py"
    path.parent.mkdir()
    path.write_text(SPRING)
    (tmp_path / "case.yaml").write_text(TEXT)
    return path


def allowed(*changes, config="case.yaml"):
    return load_config(config, changes, allow_python=True)


def problems(*changes, config="case.yaml", allow_python=True):
    with pytest.raises(ConfigError) as caught:
        load_config(config, changes, allow_python=allow_python)
    return str(caught.value).splitlines()


def test_it_is_refused_with_a_place_and_a_reason(code):
    assert problems(allow_python=False) == [
        "case.yaml:5:11: elements.mine.kind: is python: mine.py is code that would run (expected "
        "--allow-python, or allow_python=True in Python: this file runs with all your rights, so "
        "read it first)"
    ]


def test_the_resolved_config_needs_no_file(code):
    config = allowed()
    section = resolved(config)["elements"]["mine"]
    assert section == {
        "kind": "python",
        "file": "mine.py",
        "class": "Mine",
        "parameters": {"k": 3.0},
        "sha256": sha256(SPRING),
        "source": SPRING,
    }
    code.unlink()
    again = allowed(config=resolved(config))
    assert (again, run_id(again)) == (config, run_id(config))
    # A person can read the code in it.
    assert "          return force_at_centre(-self.k * motion.X)\n" in resolved_yaml(config)


def test_identity_is_that_of_text_class_and_parameters(code):
    def identity(text, *changes):
        code.write_text(text)
        return run_id(allowed(*changes))

    other = SPRING + "\n\nclass Other(Mine):\n    pass\n"
    ids = [
        identity(SPRING),
        identity(SPRING + "# a comment\n"),
        identity(SPRING, "elements.mine.parameters.k=4"),
        identity(other),
        identity(other, "elements.mine.class=Other"),
    ]
    assert len(set(ids)) == len(ids)
    assert identity(SPRING.replace("\n", "\r\n")) == identity("\ufeff" + SPRING) == ids[0]


def test_a_digest_pins_a_file(code):
    change = f"elements.mine.sha256={sha256(SPRING)}"
    allowed(change)
    code.write_text(SPRING + "# changed\n")
    (line,) = problems(change)
    assert "elements.mine.sha256: is not the SHA-256 of the file" in line


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("file=gone.py", "elements.mine.file: is gone.py, which cannot be read: No such file"),
        ("file=5", "elements.mine.file: is 5 (expected a text)"),
        ("class=Yours", "elements.mine.class: Yours: is not a class of the file (expected one of"),
        ("class=a.b", "elements.mine.class: is not the name of a class"),
        ("parameters={}", "elements.mine.parameters.k: is missing (it is required)"),
        ("parameters.k=[1]", "elements.mine.parameters.k: is a list of 1 (expected a number)"),
        ("parameters.k=-1", "elements.mine.parameters.k: is -1 (expected a number greater than 0"),
        ("parameters.kk=1", "elements.mine.parameters.kk: is unknown (did you mean k?)"),
        ("parameters=5", "elements.mine.parameters: is not a mapping"),
        ("colour=red", "elements.mine.colour: is unknown (expected one of kind, source, file,"),
    ],
)
def test_wrong_sections(code, change, expected):
    (line,) = problems(f"elements.mine.{change}")
    assert expected in line


def test_all_problems_have_their_places(code):
    text = TEXT.replace("k: 3", "k: 0, c: 1").replace("mass: 2", "mass: -2")
    code.parents[1].joinpath("case.yaml").write_text(text)
    assert [line.split(": ")[:2] for line in problems()] == [
        ["case.yaml:2:14", "body.mass"],
        ["case.yaml:8:21", "elements.mine.parameters.k"],
        ["case.yaml:8:24", "elements.mine.parameters.c"],
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("class Mine(:\n", "line 1: is not Python"),
        (b"\xff", "which cannot be read: it is not text in UTF-8"),
        ("#" * (MAX_SOURCE + 1), f"which cannot be read: it has more than {MAX_SOURCE} characters"),
        (SPRING.replace('Gain("k"', "Gain(K"), "Mine: line"),
        (SPRING + "\nraise ValueError('no')\n", "cannot be run: line"),
        (SPRING.replace("-self.k", "-self.kk"), "fails at the start: line 13: AttributeError"),
        (SPRING.replace("force_at_centre(", "list("), "wrench returns a list (expected a Wrench"),
        (SPRING.replace("(motion.X @ motion.X)", "motion.X"), "stored returns an array of shape"),
        (SPRING.replace("* motion.X)", "* motion.X[:2])"), "force of wrench is an array of shape"),
    ],
)
def test_wrong_files(code, text, expected):
    code.write_bytes(text if isinstance(text, bytes) else text.encode())
    (line,) = problems()
    assert expected in line
    assert line.startswith(("case.yaml:6:11: ", "case.yaml:7:12: "))


def test_no_file_is_looked_for_where_none_was_read(code):
    """What is validated without a file of the user must not read one."""
    with pytest.raises(ConfigError, match=r"elements\.mine\.file: was not read"):
        validated(source_of("case.yaml"))
    section = {key: value for key, value in python_section(k=1).items() if key != "file"}
    (line,) = problems(config=data({"mine": section}))
    assert "elements.mine.file: is missing (expected a Python file" in line


def test_parameters_of_every_shape(code):
    (code.parents[1] / "mine.py").write_text(SHAPED)
    config = allowed(config=data({"mine": python_section(**VALUES)}))
    element: Any = system_of(config).elements[-1]
    assert (element.a, element.e, element.f) == (1.0, 0.5, 0.5)
    assert element.copy.tolist() == [[4, 0, 0], [0, 5, 0], [0, 0, 6]]
    keys = [entry.key for entry in entries_of(config) if entry.key.startswith("elements")]
    assert keys[:4] == [f"elements.mine.parameters.{key}" for key in ("a", "b[0]", "b[1]", "b[2]")]
    element = {"kind": "python", "source": SHAPED, "class": "Mine"}
    units = [unit_of(f"{keys[0][:-1]}{name}", [element]) for name in ("a", "f", "point", "gone")]
    assert units == ["N", "1", "m", ""]
    assert unit_of(keys[0], [element | {"source": "("}]) == ""
    full = VALUES | {"copy": [[4, 1, 0], [1, 5, 0], [0, 0, 6]]}
    element = system_of(allowed(config=data({"mine": python_section(**full)}))).elements[-1]
    assert element.copy[0, 1] == 1.0
    wrong = VALUES | {"copy": [[4, 9, 0], [9, 5, 0], [0, 0, 6]], "b": [1, 0, 1], "f": 1}
    lines = problems(config=data({"mine": python_section(**wrong)}))
    assert [line.split(": ")[1] for line in lines] == [
        "elements.mine.parameters.b[1]",
        "elements.mine.parameters.copy",
        "elements.mine.parameters.f",
    ]


def test_the_permission_is_that_of_the_loaded_config(code):
    given, read = allowed(), config_to_read("case.yaml")
    stored = allowed(config=given.plain())
    assert (may_run_code(given), may_run_code(read), may_run_code(stored)) == (True, False, True)
    for config, again in product((given, read), (changed_config, None)):
        made = again(config, config.plain()) if again else pickle.loads(pickle.dumps(config))  # noqa: S301
        assert may_run_code(made) == may_run_code(config)
        assert run_id(made) == run_id(config)
    assert "allow" not in resolved_yaml(given)
    assert "may_run" not in resolved_yaml(given)
    bare = load_config(data({}))
    assert not has_code(bare)
    assert not may_run_code(bare)
    assert without_code(bare) is bare


def test_without_permission_nothing_is_built(code):
    marker = code.parent / "ran"
    code.write_text(traitor(marker))
    read = config_to_read("case.yaml")
    for build in (system_of, problem_of):
        with pytest.raises(CodeNotAllowedError, match=r"elements\.mine is code of mine\.py"):
            build(read)
    problems(allow_python=False)
    assert has_code(read)
    assert not has_code(without_code(read))
    assert [part.name for part in system_of(without_code(read)).elements] == ["gravity"]
    assert not marker.exists()
    allowed()
    assert marker.exists()


SHAKE = f"\n  shake: {force(SINE)}"
PUMP = "\n    def supplied(self, motion, states):\n        return 0 * motion.v[0]\n"


@pytest.mark.parametrize("pump", ["", PUMP], ids=["passive", "supplies"])
@pytest.mark.parametrize("shaken", [False, True], ids=["alone", "shaken"])
def test_who_supplies_power_is_known_without_running_code(code, pump, shaken):
    marker = code.parent / "ran"
    code.write_text(traitor(marker) + pump)
    config = code.parents[1] / "case.yaml"
    config.write_text(TEXT.replace("elements:", f"elements:{SHAKE * shaken}"))
    assert supplies_power(config_to_read(config)) is bool(pump or shaken)
    assert not marker.exists()
