"""Protects inputs in configs: their keys, the messages about wrong ones, and the files of tables.

The numbers of a table are part of the config: neither its identity nor a stored run needs the file.
"""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.inputs import SIGNALS, couple, driven, force

from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved, resolved_yaml, run_id
from rbstab.config.units import unit_of
from rbstab.experiment.simulate import simulate

HEAD = """\
schema_version: 2
body: {mass: 41, inertia: [10, 8, 9], contact_point: [0.15, 0.10, -0.42]}
integration: {duration: 2}
elements:
"""
INPUT = "kind: input, quantity: couple, direction: [0, 0, 1], amplitude: 1"


def problems(path: Path, element: str) -> list[str]:
    """Return the problems of a config with one element, without the name of its folder."""
    path.write_text(f"{HEAD}  a: {{{element}}}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    return [str(problem).replace(f"{path.parent}/", "") for problem in caught.value.problems]


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        (
            "kind: input",
            [
                "5:6: elements.a.quantity: is missing (expected one of force, body_force, couple, "
                "body_couple)"
            ],
        ),
        (
            "kind: input, quantity: forc",
            [
                "5:30: elements.a.quantity: is the text 'forc' (expected one of force, body_force, "
                "couple, body_couple; did you mean force?)"
            ],
        ),
        (
            "kind: input, quantity: couple, direction: [0, 0, 0], amplitude: .nan, "
            "point: [0, 0, 1]",
            [
                "5:6: elements.a.signal: is missing (it is required)",
                "5:49: elements.a.direction: is zero, which has no direction (expected a vector of "
                "any length)",
                "5:71: elements.a.amplitude: is nan (expected a finite number)",
                "5:77: elements.a.point: is unknown (expected one of kind, quantity, direction, "
                "amplitude, signal)",
            ],
        ),
        (
            f"{INPUT}, signal: sine",
            ["5:82: elements.a.signal: is the text 'sine' (expected a mapping with the key kind)"],
        ),
        (
            f"{INPUT}, signal: {{kind: pulse, strt: 1, duration: 0}}",
            [
                "5:82: elements.a.signal.start: is missing (it is required)",
                "5:96: elements.a.signal.strt: is unknown (did you mean start?)",
                "5:115: elements.a.signal.duration: is 0 (expected a number greater than 0)",
            ],
        ),
        (
            f"{INPUT}, signal: {{kind: noise, seed: 1.5, rate: 5, correlation_time: 1}}",
            ["5:102: elements.a.signal.seed: is 1.5 (expected a whole number)"],
        ),
        (
            f"{INPUT}, signal: {{kind: table}}",
            ["5:82: elements.a.signal.times: is missing (expected file, or times and values)"],
        ),
        (
            f"{INPUT}, signal: {{kind: table, times: [0, 2, 1], values: [1]}}",
            [
                "5:103: elements.a.signal.times: is not ascending (expected times that do not "
                "fall)",
            ],
        ),
        (
            f"{INPUT}, signal: {{kind: table, times: [0, 2], values: [1]}}",
            ["5:119: elements.a.signal.values: has 1 entry (expected 2, as times has)"],
        ),
        (
            f"{INPUT}, signal: {{kind: table, file: none.csv}}",
            [
                "5:102: elements.a.signal.file: is none.csv, which cannot be read: No such "
                "file or directory (expected a CSV file of times, s, and values, beside the "
                "config)"
            ],
        ),
    ],
)
def test_wrong_inputs(tmp_path, element, expected):
    found = problems(tmp_path / "x.yaml", element)
    assert found == [f"x.yaml:{problem}" for problem in expected]


KEY = "elements.a.signal.file"
TWO = "expected two finite numbers: a time, s, then a comma and a value"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", [f"1:1: {KEY}: has no row of numbers (expected a CSV file of times, s, and values)"]),
        (
            "t,s\n0,1\n1,x\n2,1,3\n3,nan\n2,1_0\n",
            [
                f"{line}:1: {KEY}: is {row} ({TWO})"
                for line, row in [(3, "1, x"), (4, "2, 1, 3"), (5, "3, nan"), (6, "2, 1_0")]
            ],
        ),
        (
            "0,1\nt,s\n0.5,1\n0.25,1\n",
            [
                f"2:1: {KEY}: is t, s ({TWO})",
                f"4:1: {KEY}: is the time 0.25 s after 0.5 s (expected times that do not fall)",
            ],
        ),
        ("0;1\n", [f"1:1: {KEY}: is 0;1 ({TWO})"]),
        ("0,1\n" * 10_001, [f"1:1: {KEY}: has 10001 rows (expected at most 10000)"]),
    ],
)
def test_wrong_tables(tmp_path, text, expected):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    found = problems(tmp_path / "x.yaml", f"{INPUT}, signal: {{kind: table, file: t.csv}}")
    assert found == [f"t.csv:{problem}" for problem in expected]


@pytest.mark.parametrize(
    ("raw", "reason"),
    [
        (b"\xff0,1", "it is not text in UTF-8 in line 1"),
        (b"0,1\n" * 300_000, "it has more than 1048576 bytes"),
    ],
)
def test_files_that_are_no_tables(tmp_path, raw, reason):
    (tmp_path / "t.csv").write_bytes(raw)
    (found,) = problems(tmp_path / "x.yaml", f"{INPUT}, signal: {{kind: table, file: t.csv}}")
    assert f": {KEY}: is t.csv, which cannot be read: {reason} (expected a CSV file" in found


@pytest.fixture
def tabled(tmp_path):
    """A config with a table in a file, and the path of that file."""
    table = tmp_path / "t.csv"
    table.write_text("time, value\n# rest\n0.1, 0\n0.5,1\n\n0.5,-1e0\n", encoding="utf-8")
    config = tmp_path / "x.yaml"
    text = f"{HEAD}  a: {{{INPUT}, signal: {{kind: table, file: t.csv}}}}\n"
    config.write_text(text, encoding="utf-8")
    return config, table


def test_the_numbers_of_a_table_take_the_place_of_the_file(tabled, monkeypatch, tmp_path_factory):
    config_path, table = tabled
    # The file is beside the config, not in the working folder.
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    config = load_config(config_path)
    signal = config.elements["a"].signal
    assert (signal.times, signal.values) == ((0.1, 0.5, 0.5), (0.0, 1.0, -1.0))
    assert signal.file is None
    digest = hashlib.sha256(table.read_bytes()).hexdigest()
    assert signal.source == f"t.csv, SHA-256 {digest}"
    stored = simulate(config).config
    table.unlink()
    again = config_path.with_name("again.yaml")
    again.write_text(stored, encoding="utf-8")
    assert load_config(again) == config
    assert run_id(load_config(again)) == run_id(config)
    assert resolved_yaml(load_config(again)) == stored


def test_other_numbers_are_another_run(tabled):
    config_path, table = tabled
    first = run_id(load_config(config_path))
    table.write_text(table.read_text().replace("0.1", "0.2"), encoding="utf-8")
    assert run_id(load_config(config_path)) != first


def test_a_table_of_an_option_is_beside_the_config(tabled):
    config_path, table = tabled
    (table.parent / "u.csv").write_text("0,3\n", encoding="utf-8")
    signal = load_config(config_path, ["elements.a.signal.file=u.csv"]).elements["a"].signal
    assert (signal.times, signal.values) == ((0.0,), (3.0,))


@pytest.mark.parametrize("kind", SIGNALS)
def test_a_config_is_what_is_resolved_of_it(kind):
    config = load_config(driven({"a": force(SIGNALS[kind]), "b": couple(SIGNALS[kind])}))
    assert load_config(resolved(config)) == config


def test_only_the_direction_counts():
    systems = [
        problem_of(load_config(driven({"a": couple(SIGNALS["sine"], direction=d)}))).system
        for d in ([1, -2, 2], [0.5, -1, 1])
    ]
    inputs: list[Any] = [system.elements[-1] for system in systems]
    directions = [one.direction for one in inputs]
    np.testing.assert_allclose(directions[0], np.array([1, -2, 2]) / 3, rtol=1e-15)
    np.testing.assert_allclose(directions[0], directions[1], rtol=1e-15)


def test_a_seed_may_be_a_whole_float():
    """A plan varies floats; the run is that of the whole number."""
    noise = SIGNALS["noise"]
    ids = [run_id(load_config(driven({"a": force(noise | {"seed": s})}))) for s in (4, 4.0, 5)]
    assert ids[0] == ids[1] != ids[2]


REFUSED: dict[str, Any] = {
    "sliding": (
        {
            "controller": {
                "variant": "sliding",
                "surface": "position",
                "law": {"implicit": 1e-3},
                **{name: [1, 1, 1] for name in ("K_t", "L_t", "K_r", "L_r", "K_s")},
            }
        },
        "elements: has a beside a sliding connector with implicit steps (expected law: exact or",
    ),
    "LSODA": (
        {"integration": {"method": "LSODA"}},
        "integration: has method: LSODA, which loses its history at each switch or leg of a (",
    ),
    "long noise": (
        {"integration": {"duration": 1e5}},
        "integration: has duration: 100000, for which the noise of a needs 1e+06 values (expected",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_inputs_do_not_fit(case):
    sections, words = REFUSED[case]
    with pytest.raises(ConfigError) as caught:
        load_config(driven({"a": force(SIGNALS["noise"])}, **sections))
    assert len(caught.value.problems) == 1
    assert words in str(caught.value)


def test_a_smooth_input_fits_lsoda():
    load_config(driven({"a": force(SIGNALS["sine"])}, integration={"method": "LSODA"}))


def test_units():
    assert unit_of("elements.a.amplitude", {("input", "force")}) == "N"
    assert unit_of("elements.a.amplitude", {("input", "body_couple")}) == "N m"
    assert unit_of("elements.a.signal.frequency", {("input", "force")}) == "Hz"
    assert unit_of("elements.a.signal.seed", {("input", "force")}) == "1"
