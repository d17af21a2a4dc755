"""Protects against hostile manifests, shards, comparisons and proofs, whose digests are right."""

import hashlib
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.configs import VISCO_ELASTIC, plain
from support.results import sealed
from support.sweeping import Listener, run_sweep
from support.sweeps import plan_of, plan_with_traces, shard_files

from rbstab.config.load import load_config
from rbstab.experiment.proof_cache import cached_proof, proof_file, proof_for
from rbstab.store.dataset_file import write_dataset
from rbstab.store.disk.seal import SEAL_SIZE
from rbstab.store.document import read_document, write_document
from rbstab.store.errors import NotAResultError
from rbstab.store.result import RESULT
from rbstab.store.table import Table
from rbstab.store.variables import RUN, Variable
from rbstab.sweep.folder.scipy_comparison import ScipyComparison, comparison_of
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_folder import read_folder

TIME_LIMIT = 40.0
"""s; the promise of 5 s, for a machine with ten times as much work as processors."""

WRONG_MANIFESTS: list[tuple[str, Any]] = [
    *(("members", value) for value in ("x", 0, -1, 10**12, 10**400, 60.0, True, None)),
    *(("members", value) for value in (59, 61, 100_000_000)),
    *(("shard_size", value) for value in (0, -5, 2.5, 2**70)),
    *(("plan_id", value) for value in (5, "0" * 31, "../../../../etc/passwd")),
    *(("engine", value) for value in ("", "evil", "../scipy", "heyoka")),
    *(("title", value) for value in (None, "x" * 201, "\ud800")),
    *(("versions", value) for value in ({"a": 1}, {"x" * 101: "1"}, {"\x1b[31m": "1"})),
    ("versions", {f"v{number}": "1" for number in range(51)}),
    *(("columns", value) for value in ("status", ["status"], [1])),
    *(("keep", {"members": value}) for value in ("x", [3, 2], [2, 2], [60], [-1], [[1]])),
    *(("keep", value) for value in (None, {"every": -1}, {"every": 1, "members": [0]})),
    ("keep", {"every": 2}),
    *(("schema_version", value) for value in (0, 1, 4, "3", 2.5, True, None, 10**30)),
    ("extra", 1),
]


@pytest.fixture(scope="module")
def unfinished(tmp_path_factory):
    """A sweep of 60 members in shards of 10; two shards are stored."""
    folder = tmp_path_factory.mktemp("unfinished") / "fake"
    run_sweep(folder, plan_of(60), Listener(2), shard_size=10, threads=1)
    for path in sorted((folder / "shards").iterdir())[2:]:
        path.unlink()
    return folder


@pytest.fixture
def folder(unfinished, tmp_path):
    return Path(shutil.copytree(unfinished, tmp_path / "fake"))


def change(folder, key, value):
    """Change an entry of a manifest; its digest is right again."""
    path = folder / "manifest.json"
    data = {**read_document(path), key: value}
    # Written here: `write_document` refuses texts that are no Unicode.
    digest = write_digest(data)
    path.write_text(json.dumps({**data, "digest": digest}), encoding="utf-8")


def write_digest(data):
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def test_good_manifest_is_read(folder):
    assert read_folder(folder).manifest.members == 60
    change(folder, "title", "another title")
    assert read_folder(folder).manifest.title == "another title"


@pytest.mark.slow
@pytest.mark.parametrize(("key", "value"), WRONG_MANIFESTS, ids=lambda value: repr(value)[:30])
def test_wrong_manifest(reader, folder, key, value):
    change(folder, key, value)
    before = shard_files(folder)
    plan = folder / "plan.yaml"
    for way, *arguments in (
        ("sweep", folder),
        ("traces", folder),
        ("sources", folder),
        ("sweep_command", "--status", folder),
        ("sweep_command", plan, "-o", folder.parent),
        ("sweep_command", plan, "-o", folder.parent, "--dry-run"),
    ):
        attempt = reader.attempt(way, *arguments)
        # Only the plan shows that a possible manifest is another sweep's.
        possible = (key, value) in POSSIBLE_MANIFESTS and arguments[:1] != [plan]
        # A command uses the engine of the manifest; the folder then holds another sweep.
        possible |= key == "engine" and value == "heyoka" and "--dry-run" in arguments
        other = key == "engine" and arguments[:1] == [plan]
        outcomes = {"NotAResultError", "StoreError", "exit 4", "read"}
        outcomes |= {*["exit 0"] * possible, *["exit 2"] * other}
        assert attempt.outcome in outcomes, (way, attempt)
        assert attempt.outcome != "read" or "Unread" in attempt.text, (way, attempt)
        assert attempt.seconds < TIME_LIMIT
    assert shard_files(folder) == before


POSSIBLE_MANIFESTS = [
    ("members", 61),
    ("members", 59),
    ("engine", "heyoka"),
    ("keep", {"every": 2}),
]


@pytest.mark.parametrize(
    "content",
    [
        b"[1, 2]",
        b"{}",
        b"\xff\xfe{}",
        b'{"a":' * 50_000,
        b'{"members": NaN, "digest": ""}',
        b'{"members": ' + b"9" * 100_000 + b', "digest": ""}',
        b"[" + b"{}," * 3_000_000 + b"{}]",
        b" " * (17 << 20) + b"{}",
    ],
    ids=range(8),
)
def test_wrong_document(folder, content):
    (folder / "manifest.json").write_bytes(content)
    with pytest.raises(NotAResultError):
        read_folder(folder)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.slow
def test_pipes_in_place_of_files(reader, folder):
    for path in (stored_shard(folder), folder / "manifest.json"):
        path.unlink()
        os.mkfifo(path)
        attempt = reader.attempt("sweep_command", "--status", folder)
        assert attempt.outcome == "exit 4", attempt
        assert str(path) in attempt.text


def change_index(path, change):
    """Change the index of a file; its seal is right again."""
    content = path.read_bytes()[:-SEAL_SIZE]
    arrays, _, line = content.rpartition(b"\n")
    index = json.loads(line)
    change(index)
    path.write_bytes(sealed(arrays + b"\n" + json.dumps(index).encode()))


def entry(name, **changes):
    """Return a change of what an index says of an array."""
    return lambda index: index["arrays"][name].update(changes)


def attribute(**changes):
    """Return a change of the attributes in an index."""
    return lambda index: index["attributes"].update(changes)


FORGED: dict[str, Callable[[dict[str, Any]], object]] = {
    "another manifest": attribute(manifest="0" * 64),
    "no manifest": lambda index: index["attributes"].clear(),
    "another kind": lambda index: index.update(kind=RESULT),
    "no column": lambda index: index["arrays"].pop("status"),
    "one column more": lambda index: index["arrays"].update(more=index["arrays"]["status"]),
    "no numbers of the members": lambda index: index["arrays"].pop(RUN),
    "another unit": entry("settling_time", unit="ms"),
    "other words": entry("status", flags=["completed", "diverged"]),
    "the words in another order": lambda index: index["arrays"]["status"]["flags"].reverse(),
    "another type": entry("settling_time", type="<i8"),
    "objects": entry("settling_time", type="|O8"),
    "another dimension": entry("settling_time", dimensions=["axis"]),
    "columns exchanged": lambda index: index["arrays"].update(
        end_time=index["arrays"]["settling_time"], settling_time=index["arrays"]["status"]
    ),
    "the numbers of other members": lambda index: entry(
        RUN, offset=index["arrays"]["settling_time"]["offset"]
    )(index),
}


@pytest.mark.parametrize("name", FORGED)
def test_forged_shard(folder, name):
    """What the index of a shard says is compared with the manifest."""
    change_index(stored_shard(folder), FORGED[name])
    assert_damaged(folder)


@pytest.mark.parametrize("length", [0, 1, 9, 11, 10**6, 10**12, 10**18])
def test_shard_of_another_length(folder, length):
    def change(index):
        for array in index["arrays"].values():
            array["shape"][0] = length

    change_index(stored_shard(folder), change)
    assert_damaged(folder)


@pytest.mark.parametrize("shift", [-10, 1, 10, 2**62])
def test_shard_with_the_numbers_of_other_members(folder, shift):
    rewrite(folder, lambda arrays: {RUN: arrays[RUN] + shift})
    assert_damaged(folder)


@pytest.mark.parametrize(
    ("column", "values"),
    [("status", 99), ("status", -1)],
)
def test_shard_with_wrong_values(folder, column, values):
    def change(arrays):
        wrong = arrays[column].copy()
        wrong[3] = np.array(values).astype(wrong.dtype)
        return {column: wrong}

    rewrite(folder, change)
    assert_damaged(folder)


def rewrite(folder, change):
    """Write a stored shard again, with other values."""
    sweep = read_folder(folder)
    number = min(shard_inventory(sweep).done)
    table = sweep.read(number)
    changed = change({name: table[name] for name in ["run", *table.columns]})
    variables = {name: table.variables[name]._replace(data=data) for name, data in changed.items()}
    whole = replace(table, variables={**table.variables, **variables})
    write_dataset(sweep.shard_file(number), whole, replace=True)


def test_a_shard_that_is_written_again_is_whole(folder):
    """The tests above fail for what they change."""
    rewrite(folder, lambda _: {})
    change_index(stored_shard(folder), lambda _: None)
    assert len(shard_inventory(read_folder(folder)).done) == 2


def stored_shard(folder):
    sweep = read_folder(folder)
    return sweep.shard_file(min(shard_inventory(sweep).done))


def assert_damaged(folder):
    """Assert that one of two stored shards is damaged, and is computed again."""
    sweep = read_folder(folder)
    inventory = shard_inventory(sweep)
    assert (len(inventory.done), len(inventory.damaged)) == (1, 1)
    assert set(inventory.damaged) < set(inventory.missing)
    listener = Listener()
    assert run_sweep(folder, plan_of(60), listener, shard_size=10).finished
    assert inventory.damaged[0] in listener.computed


TRACES_ATTRIBUTES = [
    {"traces_bytes": "x"},
    {"traces_bytes": -1},
    {"traces_bytes": 1.5},
    {"traces_bytes": True},
    {"traces_digest": 5},
    {"traces_digest": "x"},
]


@pytest.mark.parametrize("attributes", TRACES_ATTRIBUTES, ids=repr)
def test_shard_with_a_wrong_digest_of_its_traces(tmp_path, attributes):
    run_sweep(tmp_path / "a", plan_with_traces(20), shard_size=20)
    sweep = read_folder(tmp_path / "a")
    assert len(shard_inventory(sweep).done) == 1
    change_index(sweep.shard_file(0), attribute(**attributes))
    assert shard_inventory(sweep).damaged == [0]


COMPARISONS = [
    {"unlike": "x"},
    {"check_column": Variable(("check_number",), np.array(["no"], object), "", "")},
    {"check_member": Variable(("check_run",), np.array(["x"], object), "", "")},
]


@pytest.mark.parametrize("wrong", COMPARISONS, ids=["unlike", "column", "member"])
def test_wrong_comparison_counts_as_missing(folder, wrong):
    """What is compared again is then compared with the stored members."""
    sweep, good = read_folder(folder), ScipyComparison((3, 40), 1, {"end_time": 1e-9})
    attributes = {"shards_digest": "0" * 64, "checked_unlike": wrong.pop("unlike", 1)}
    variables = good.variables
    whole = Table(variables, {**attributes, "checked_unlike": 1})
    assert comparison_of(sweep, whole) == good
    assert comparison_of(sweep, Table({**variables, **wrong}, attributes)) is None


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    """A config, and the file of its proof."""
    folder = tmp_path_factory.mktemp("proofs")
    config = load_config(plain(VISCO_ELASTIC))
    proof_for(folder, config)
    return config, proof_file(folder, config)


@pytest.mark.parametrize(
    "wrong",
    [
        {"id": 5},
        {"proved": "yes"},
        {"unique": False},
        {"states": []},
        {"states": [{}]},
        {"examined": -1},
        {"undecided": [[1, 2]]},
        {"region": {"energy": 1}},
        {"more": 1},
    ],
    ids=repr,
)
def test_wrong_proof_counts_as_missing(proof, tmp_path, wrong):
    config, path = proof
    copy = proof_file(tmp_path, config)
    write_document(copy, read_document(path))
    assert cached_proof(tmp_path, config) is not None
    write_document(copy, read_document(path) | wrong)
    assert cached_proof(tmp_path, config) is None


def test_shards_are_counted_without_looking_for_each(folder, monkeypatch):
    """A hundred million shards would take minutes."""
    looked = []

    def look(path, *_):
        looked.append(path)
        raise NotAResultError("not now")

    monkeypatch.setattr("rbstab.sweep.folder.sweep_folder.read_table", look)
    sweep = read_folder(folder)
    object.__setattr__(sweep.manifest, "members", 1_000_000)
    assert sweep.shards == 100_000
    assert len(shard_inventory(sweep).missing) == 100_000
    assert len(looked) == 2
