"""Protects against damaged files: no number that differs is read without a word.

Every kind of file is damaged in many ways: bits, blocks, ends. The seal is damaged too, removed, or
made right again. 100 trials run daily, 2,000 in the long suite.
"""

import shutil
from pathlib import Path

import pytest
from faults.hostile.damage import (
    DAMAGES,
    SEALS,
    damaged,
    damaged_and_sealed,
    is_sealed_again,
)
from support.stored_proofs import store_proof_of
from support.sweeping import run_sweep
from support.sweeps import plan_with_traces

STORED_RUN = Path("tests/formats/data/format_1/runs/visco_elastic_proved.h5")

ERRORS = ("StoreError", "NotAResultError", "NewerSchemaError")

TIME_LIMIT = 40.0
"""s; the promise of 5 s, for a machine with ten times as much work as processors."""

DAILY, LONG = 14, 275
"""Trials for each of seven kinds of files; all pairs of damage and seal need 24."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished sweep with traces."""
    folder = tmp_path_factory.mktemp("finished") / "fake"
    assert run_sweep(folder, plan_with_traces(20), shard_size=10).finished
    return folder


@pytest.fixture
def folder(finished, tmp_path):
    """A copy of the finished sweep."""
    return Path(shutil.copytree(finished, tmp_path / "fake"))


def seeds_of(count):
    """Return seeds that cover all kinds of damage and seals as evenly as possible."""
    return range(count) if count >= len(DAMAGES) * len(SEALS) else range(0, 5 * count, 5)


def check(attempt, path, context):
    """Check the outcome, the time and the memory of an attempt to read a file."""
    assert attempt.outcome in ("read", *ERRORS), (context, attempt)
    assert attempt.seconds < TIME_LIMIT, (context, attempt)
    assert attempt.memory <= 4 * path.stat().st_size + 300e6, (context, attempt)


def attempts(reader, path, count, way, named):
    """Damage a file without its seal in many ways, and yield each seed with what is read then."""
    good = path.read_bytes()
    for seed in seeds_of(count):
        path.write_bytes(damaged(good, seed))
        yield seed, reader.attempt(way, named)


def read_damaged(reader, way, named, path, count):
    """Damage a file in many ways, and check that reading gives its old content or an error.

    Args:
        reader: Reads the file.
        way: The way to read it.
        named: What to name to the reader: the file or its folder.
        path: The file.
        count: The number of trials.

    Returns:
        The number of trials in which the damage was noticed.
    """
    expected = reader.attempt(way, named)
    assert expected.outcome == "read", expected
    good, noticed = path.read_bytes(), 0
    for seed in seeds_of(count):
        path.write_bytes(damaged_and_sealed(good, seed))
        attempt = reader.attempt(way, named)
        check(attempt, path, seed)
        # With a right seal the file may be any other one: a seal is no signature.
        if not is_sealed_again(seed):
            assert attempt.outcome != "read" or attempt.text == expected.text, seed
        noticed += attempt.outcome != "read"
    path.write_bytes(good)
    assert reader.attempt(way, named).text == expected.text
    return noticed


COUNTS = pytest.mark.parametrize(
    "count",
    [
        pytest.param(DAILY, marks=pytest.mark.slow),
        pytest.param(LONG, marks=pytest.mark.long),
    ],
)


@COUNTS
def test_file_of_a_run(reader, tmp_path, count):
    path = Path(shutil.copy(STORED_RUN, tmp_path / "a.h5"))
    assert read_damaged(reader, "run", path, path, count) > 0.5 * count


@COUNTS
def test_file_of_a_sweep(reader, folder, count):
    path = folder / "members.h5"
    assert read_damaged(reader, "sweep", path, path, count) > 0.5 * count


@COUNTS
def test_traces(reader, folder, count):
    """The shard has the digest of its traces, so a seal that is right again does not help."""
    path = folder / "traces" / "00000001.h5"
    assert read_damaged(reader, "traces", folder, path, count) > 0.9 * count


@COUNTS
@pytest.mark.parametrize("name", ["00000000.h5", "00000001.h5"])
def test_shards(reader, folder, count, name):
    """A shard is read whole or counts as damaged. Its seal is the digest of its numbers."""
    path = folder / "shards" / name
    whole = reader.attempt("inventory", folder)
    assert whole.outcome == "read"
    good = path.read_bytes()
    for seed, attempt in attempts(reader, path, count, "inventory", folder):
        check(attempt, path, seed)
        assert attempt.outcome == "read", attempt
        assert (attempt.text == whole.text) == (path.read_bytes() == good), seed
        path.write_bytes(damaged_and_sealed(good, seed))
        check(reader.attempt("inventory", folder), path, seed)


@COUNTS
def test_manifest(reader, folder, count):
    path = folder / "manifest.json"
    expected = reader.attempt("inventory", folder)
    for seed, attempt in attempts(reader, path, count, "inventory", folder):
        check(attempt, path, seed)
        assert attempt.outcome != "read" or attempt.text == expected.text, seed


@COUNTS
def test_plan(reader, folder, count):
    """The manifest has the identity of the plan."""
    path = folder / "plan.yaml"
    table = reader.attempt("sweep", folder).text
    for seed, attempt in attempts(reader, path, count, "show_command", folder):
        assert attempt.outcome in ("exit 0", "exit 4"), (seed, attempt)
        assert attempt.seconds < TIME_LIMIT, (seed, attempt)
        assert reader.attempt("sweep", folder).text == table


@COUNTS
def test_proof(reader, tmp_path, count):
    path = store_proof_of(STORED_RUN, tmp_path)
    run = Path(shutil.copy(STORED_RUN, tmp_path / "a.h5"))
    expected = reader.attempt("proof", run)
    assert expected.outcome == "read"
    assert expected.text != "None"
    for seed, attempt in attempts(reader, path, count, "proof", run):
        check(attempt, path, seed)
        assert attempt.text in ("None", expected.text), seed
