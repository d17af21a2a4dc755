"""Protects `kind: python` in configs: refused unless allowed, its text part of the config."""

import pickle
from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.inputs import SINE, force
from support.switching import data
from support.user_code import CUBIC, HEAD, SPRING, element_text, mine, traitor, write_template

from rbstab.config.build import problem_of, supplies_power, system_of
from rbstab.config.errors import ConfigError
from rbstab.config.files.dump import as_yaml
from rbstab.config.load import (
    changed_config,
    config_to_read,
    load_config,
    plain_data,
    resolved,
    resolved_yaml,
    run_id,
    source_of,
    validated,
)
from rbstab.config.numbers import entries_of
from rbstab.config.source import parse_source
from rbstab.config.units import Kind, unit_of
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
    "def wrench(self, motion, own):\n    return force_at_centre(0 * motion.X)", SHAPES
)

VALUES = {"a": 1, "b": [1, 2, 3], "copy": [4, 5, 6], "d": -1, "f": 0.5, "point": [0, -1, 0]}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with `case.yaml`, and its element in a folder beside it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mine.py").write_text(SPRING)
    (tmp_path / "case.yaml").write_text(TEXT)
    return tmp_path


def element_of(config) -> Any:
    return system_of(config).elements[-1]


def problems(config, changes=(), allow_python=True):
    with pytest.raises(ConfigError) as found:
        load_config(config, changes, allow_python=allow_python)
    return str(found.value).splitlines()


def test_it_is_refused_with_a_place_and_a_reason(folder):
    (line,) = problems("case.yaml", allow_python=False)
    assert line == (
        "case.yaml:5:11: elements.mine.kind: is python: mine.py is code that would run (expected "
        "--allow-python, or allow_python=True in Python: this file runs with all your rights, so "
        "read it first)"
    )


def test_the_resolved_config_needs_no_file(folder):
    config = load_config("case.yaml", allow_python=True)
    section = resolved(config)["elements"]["mine"]
    assert section == {
        "kind": "python",
        "file": "mine.py",
        "class": "Mine",
        "parameters": {"k": 3.0},
        "sha256": sha256(SPRING),
        "source": SPRING,
    }
    assert list(section)[-1] == "source"
    (folder / "parts" / "mine.py").unlink()
    text = resolved_yaml(config)
    again = load_config(parse_source(text, "stored").data, allow_python=True)
    assert run_id(again) == run_id(config)
    assert again == config


def test_a_text_is_stored_as_lines_that_a_person_can_read(folder):
    text = resolved_yaml(load_config("case.yaml", allow_python=True))
    assert "    source: |+\n" in text
    assert "          return force_at_centre(-self.k * motion.X)\n" in text


LINES = st.lists(
    st.text(st.sampled_from(" \t#:'\"\\|-{é½\x85\u2028"), max_size=6), min_size=1, max_size=5
)


@given(LINES)
def test_every_text_is_stored_as_it_is(lines):
    text = "\n".join(lines)
    stored = as_yaml({"kind": "python", "source": text})
    assert parse_source(stored, "stored").data == {"kind": "python", "source": text}


def test_identity_is_that_of_text_class_and_parameters(folder):
    def identity(text, *changes):
        (folder / "parts" / "mine.py").write_text(text)
        return run_id(load_config("case.yaml", changes, allow_python=True))

    other = SPRING + "\n\nclass Other(Mine):\n    pass\n"
    ids = [
        identity(SPRING),
        identity(SPRING + "# a comment\n"),
        identity(SPRING, "elements.mine.parameters.k=4"),
        identity(other),
        identity(other, "elements.mine.class=Other"),
    ]
    assert len(set(ids)) == len(ids)
    assert identity(SPRING.replace("\n", "\r\n")) == ids[0]
    assert identity("\ufeff" + SPRING) == ids[0]


def test_a_digest_pins_a_file(folder):
    change = f"elements.mine.sha256={sha256(SPRING)}"
    load_config("case.yaml", [change], allow_python=True)
    (folder / "parts" / "mine.py").write_text(SPRING + "# changed\n")
    (line,) = problems("case.yaml", [change])
    assert "elements.mine.sha256: is not the SHA-256 of the file" in line


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("file=gone.py", "elements.mine.file: is gone.py, which cannot be read: No such file"),
        ("file=parts", "elements.mine.file: is parts, which cannot be read: Is a directory"),
        ("file=5", "elements.mine.file: is 5 (expected a text)"),
        ("class=Yours", "elements.mine.class: Yours: is not a class of the file (expected one of"),
        ("class=5", "elements.mine.class: is 5 (expected a text)"),
        ("class=a.b", "elements.mine.class: is not the name of a class"),
        ("parameters={}", "elements.mine.parameters.k: is missing (it is required)"),
        ("parameters.k=[1]", "elements.mine.parameters.k: is a list of 1 (expected a number)"),
        ("parameters.k=-1", "elements.mine.parameters.k: is -1 (expected a number greater than 0"),
        ("parameters.kk=1", "elements.mine.parameters.kk: is unknown (did you mean k?)"),
        ("parameters=5", "elements.mine.parameters: is not a mapping"),
        ("colour=red", "elements.mine.colour: is unknown (expected one of kind, source, file,"),
    ],
)
def test_wrong_sections(folder, change, expected):
    (line,) = problems("case.yaml", [f"elements.mine.{change}"])
    assert expected in line


def test_places_in_the_file(folder):
    path = folder / "case.yaml"
    path.write_text(TEXT.replace("Mine", "Yours").replace("parts/", "gone/"))
    assert problems(path)[0].startswith(f"{path}:6:11: elements.mine.file: is ")
    path.write_text(TEXT.replace("k: 3", "k: 0, c: 1"))
    wrong, unknown = problems(path)
    assert wrong.startswith(f"{path}:8:21: elements.mine.parameters.k: is 0 (")
    assert unknown.startswith(f"{path}:8:24: elements.mine.parameters.c: is unknown")


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
def test_wrong_files(folder, text, expected):
    path = folder / "parts" / "mine.py"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    (line,) = problems("case.yaml")
    assert expected in line
    assert line.startswith(("case.yaml:6:11: ", "case.yaml:7:12: "))


def test_all_problems_at_once(folder):
    lines = problems(
        "case.yaml", ["elements.mine.parameters.k=0", "body.mass=-1", "elements.mine.x=1"]
    )
    assert len(lines) == 3


def test_a_stored_config_reads_no_file(folder):
    """What is validated without a file of the user must not look for one."""
    with pytest.raises(ConfigError, match=r"elements\.mine\.file: was not read"):
        validated(source_of(folder / "case.yaml"))


def test_no_file_at_all(folder):
    section = {key: value for key, value in mine(k=1).items() if key != "file"}
    (line,) = problems(data({"mine": section}))
    assert "elements.mine.file: is missing (expected a Python file" in line


def test_parameters_of_every_shape(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(SHAPED)
    config = load_config(data({"mine": mine(**VALUES)}), allow_python=True)
    element = element_of(config)
    assert (element.a, element.e, element.f) == (1.0, 0.5, 0.5)
    assert element.copy.shape == (3, 3)
    keys = [entry.key for entry in entries_of(config) if entry.key.startswith("elements")]
    assert keys[:4] == [f"elements.mine.parameters.{key}" for key in ("a", "b[0]", "b[1]", "b[2]")]
    full = VALUES | {"copy": [[4, 1, 0], [1, 5, 0], [0, 0, 6]]}
    config = load_config(data({"mine": mine(**full)}), allow_python=True)
    assert element_of(config).copy[0, 1] == 1.0
    wrong = VALUES | {"copy": [[4, 9, 0], [9, 5, 0], [0, 0, 6]], "b": [1, 0, 1], "f": 1}
    lines = problems(data({"mine": mine(**wrong)}))
    assert [line.split(": ")[1] for line in lines] == [
        "elements.mine.parameters.b[1]",
        "elements.mine.parameters.copy",
        "elements.mine.parameters.f",
    ]


def test_units():
    kind = Kind("python", None, SHAPED, "Mine")
    assert unit_of("elements.mine.parameters.point", {kind}) == "m"
    assert unit_of("elements.mine.parameters.a", {kind}) == "N"
    assert unit_of("elements.mine.parameters.gone", {kind}) == ""
    assert unit_of("elements.mine.class", {kind}) == ""
    assert unit_of("elements.mine.parameters.a", {kind._replace(source="(")}) == ""


def test_the_permission_is_that_of_the_loaded_config(folder):
    allowed = load_config("case.yaml", allow_python=True)
    read = config_to_read("case.yaml")
    stored = load_config(plain_data(allowed), allow_python=True)
    assert (may_run_code(allowed), may_run_code(read), may_run_code(stored)) == (True, False, True)
    for config, again in product((allowed, read), (changed_config, None)):
        made = again(config, plain_data(config)) if again else pickle.loads(pickle.dumps(config))  # noqa: S301
        assert may_run_code(made) == may_run_code(config)
        assert run_id(made) == run_id(config)
    assert "allow" not in resolved_yaml(allowed)
    assert "may_run" not in resolved_yaml(allowed)


def test_without_permission_nothing_is_built(folder):
    marker = folder / "ran"
    (folder / "parts" / "mine.py").write_text(traitor(marker))
    read = config_to_read("case.yaml")
    for build in (system_of, problem_of):
        with pytest.raises(CodeNotAllowedError, match=r"elements\.mine is code of mine\.py"):
            build(read)
    problems("case.yaml", allow_python=False)
    assert has_code(read)
    assert not has_code(without_code(read))
    assert [part.name for part in system_of(without_code(read)).elements] == ["gravity"]
    assert not marker.exists()
    load_config("case.yaml", allow_python=True)
    assert marker.exists()


def test_a_config_without_code_needs_no_permission():
    config = load_config(data({}))
    assert not has_code(config)
    assert not may_run_code(config)
    assert without_code(config) is config


def test_the_template_beside_a_config(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_template(tmp_path)
    config = load_config(data({"mine": CUBIC}), allow_python=True)
    assert element_of(config).k.tolist() == [30.0, 20.0, 10.0]
    assert HEAD not in resolved_yaml(config)


SHAKE = f"\n  shake: {force(SINE)}"
PUMP = "\n    def supplied(self, motion, own):\n        return 0 * motion.v[0]\n"


@pytest.mark.parametrize("code", ["", PUMP], ids=["passive", "supplies"])
@pytest.mark.parametrize("shaken", [False, True], ids=["alone", "shaken"])
def test_who_supplies_power_is_known_without_running_code(folder, code, shaken):
    marker = folder / "ran"
    (folder / "parts" / "mine.py").write_text(traitor(marker) + code)
    (folder / "case.yaml").write_text(TEXT.replace("elements:", f"elements:{SHAKE * shaken}"))
    assert supplies_power(config_to_read("case.yaml")) is bool(code or shaken)
    assert not marker.exists()
