"""Protects the tables of inputs: their files, and their numbers, which are part of the config.

Neither the identity of a run nor a stored run needs the file.
"""

import hashlib

import pytest

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved_yaml, run_id

CONFIG = """\
schema_version: 2
body: {mass: 41, inertia: [10, 8, 9], contact_point: [0.15, 0.10, -0.42]}
integration: {duration: 2}
elements:
  a: {kind: input, quantity: couple, direction: [0, 0, 1], amplitude: 1,
      signal: {kind: table, file: t.csv}}
"""

KEY = "elements.a.signal.file"
TWO = "expected two finite numbers: a time, s, then a comma and a value"


@pytest.fixture
def table(tmp_path, monkeypatch):
    """The file of a table beside its config, and not in the working folder."""
    (tmp_path / "x.yaml").write_text(CONFIG, encoding="utf-8")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    path = tmp_path / "t.csv"
    path.write_text("time, value\n# rest\n0.1, 0\n0.5,1\n\n0.5,-1e0\n", encoding="utf-8")
    return path


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
        (b"\xff0,1", ["is t.csv, which cannot be read: it is not text in UTF-8 in line 1 ("]),
        (b"0,1\n" * 300_000, ["is t.csv, which cannot be read: it has more than 1048576 bytes ("]),
    ],
    ids=lambda value: repr(value)[:20],
)
def test_wrong_tables_are_refused(table, text, expected):
    table.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ConfigError) as caught:
        load_config(table.with_name("x.yaml"))
    assert len(caught.value.problems) == len(expected)
    for problem, words in zip(caught.value.problems, expected, strict=True):
        assert words in str(problem).replace(f"{table.parent}/", "").removeprefix("t.csv:")


def test_the_numbers_of_a_table_take_the_place_of_the_file(table):
    path = table.with_name("x.yaml")
    config = load_config(path)
    signal = config.elements["a"].signal
    assert (signal.times, signal.values) == ((0.1, 0.5, 0.5), (0.0, 1.0, -1.0))
    assert signal.file is None
    digest = hashlib.sha256(table.read_bytes()).hexdigest()
    assert signal.source == f"t.csv, SHA-256 {digest}"
    table.write_text(table.read_text().replace("0.1", "0.2"), encoding="utf-8")
    assert run_id(load_config(path)) != run_id(config)
    table.unlink()
    stored = path.with_name("again.yaml")
    stored.write_text(resolved_yaml(config), encoding="utf-8")
    again = load_config(stored)
    assert (again, run_id(again), resolved_yaml(again)) == (
        config,
        run_id(config),
        stored.read_text(encoding="utf-8"),
    )


def test_a_table_of_an_option_is_beside_the_config_too(table):
    table.with_name("u.csv").write_text("0,3\n", encoding="utf-8")
    changed = load_config(table.with_name("x.yaml"), [f"{KEY}=u.csv"])
    assert (changed.elements["a"].signal.times, changed.elements["a"].signal.values) == (
        (0.0,),
        (3.0,),
    )
