"""Protects against hostile HDF5 files: each is read, or refused by an error of the store.

A file may have a right seal, because anybody can compute one. Reading it takes less than 5 s and
less than 4 times its size and 300 MB of memory.
"""

import shutil
import sys
from pathlib import Path

import pytest
from faults.hostile.attempts import Attempt
from faults.hostile.hdf5_files import KINDS, write_hostile
from faults.hostile.raw_bytes import patched
from faults.hostile.reader import reading
from support.sweeping import run_sweep
from support.sweeps import plan_with_traces

from rbstab.store.disk.seal import SEAL_SIZE, add_seal, seal_digest
from rbstab.store.motions_file import FileChecksum
from rbstab.store.shard_file import read_shard, write_shard
from rbstab.store.table import RUN, TableHeader
from rbstab.sweep.folder.sweep_folder import read_folder

pytestmark = pytest.mark.slow

STORED_RUN = Path("tests/formats/data/0.1.0/runs/visco_elastic_proved.h5")

OTHER_RUN = Path("tests/formats/data/0.1.0/runs/embedded.h5")

ERRORS = ("StoreError", "NotAResultError", "NewerSchemaError")

COMMANDS = ("exit 0", "exit 4")

TIME_LIMIT = 40.0
"""s; the promise of 5 s, for a machine with ten times as much work as processors."""

MEBIBYTE = 1 << 20

SWEEP_ARRAY, RUN_ARRAY = "settling_time", "lyapunov"

GATHERED_KINDS = (
    "billion_in_chunks",
    "gzip_bomb",
    "endless_heap",
    "heap_of_any_size",
    "many_arrays",
    "soft_link",
    "config_is_an_array",
    "scale_with_an_undecodable_name",
    "attributes_of_wrong_types",
    "nothing",
)


@pytest.fixture(scope="module")
def reader():
    with reading() as started:
        yield started


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished sweep with traces."""
    folder = tmp_path_factory.mktemp("finished") / "fake"
    assert run_sweep(folder, plan_with_traces(20), shard_size=20).finished
    return folder


@pytest.fixture
def folder(finished, tmp_path):
    """A copy of the finished sweep."""
    return Path(shutil.copytree(finished, tmp_path / "fake"))


def check(attempt: Attempt, path: Path) -> None:
    """Check the outcome, the time and the memory of an attempt to read a file."""
    assert attempt.outcome in ("read", *ERRORS, *COMMANDS), attempt
    assert attempt.seconds < TIME_LIMIT, attempt
    assert attempt.memory <= 4 * path.stat().st_size + 300e6, attempt


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells the largest memory")
def test_memory_is_measured(reader):
    taken = reader.attempt("allocate", 400 * MEBIBYTE)
    assert taken.outcome == "read"
    assert taken.memory > 400 * MEBIBYTE
    assert 0 < reader.attempt("run", STORED_RUN).memory < 300 * MEBIBYTE


def test_crash_and_hang_are_seen(monkeypatch):
    monkeypatch.setattr("faults.hostile.reader.PATIENCE", 0.01)
    with reading() as started:
        assert started.attempt("run", STORED_RUN).outcome == "hang"


@pytest.mark.parametrize("kind", KINDS)
def test_file_of_a_run(reader, tmp_path, kind):
    path = tmp_path / "hostile.h5"
    expected = reader.attempt("run", STORED_RUN).text
    for sealed in (True, False):
        write_hostile(kind, STORED_RUN, RUN_ARRAY, path, sealed=sealed)
        found = reader.attempt("run", path)
        check(found, path)
        # Some changes concern nothing that a result has.
        assert found.outcome != "read" or found.text == expected
        shown = reader.attempt("show", path)
        check(shown, path)
        assert (shown.outcome == "exit 0") == (found.outcome == "read"), shown
        listed = reader.attempt("sources", path)
        check(listed, path)
        assert ("Unread" in listed.text) == (found.outcome != "read"), listed


def test_report_names_hostile_files_and_shows_the_others(reader, tmp_path):
    hostile = []
    for kind in KINDS:
        path = tmp_path / f"{kind}.h5"
        write_hostile(kind, STORED_RUN, RUN_ARRAY, path, sealed=True)
        if reader.attempt("run", path).outcome == "read":
            path.unlink()
        else:
            hostile.append(path)
    assert len(hostile) > 60
    done = reader.attempt("report", *hostile, OTHER_RUN, "--json")
    assert done.outcome == "exit 4", done
    assert done.memory <= 300e6 + 4 * max(path.stat().st_size for path in hostile)
    for path in hostile:
        assert f"{path.name}:" in done.text
    assert "No result could be read" not in done.text
    alone = reader.attempt("report", hostile[0], "--json")
    assert "No result could be read" in alone.text


@pytest.mark.parametrize("kind", KINDS)
def test_file_of_a_sweep(reader, folder, kind):
    path = folder / "sweep.h5"
    good = path.with_name("good.h5")
    path.rename(good)
    expected = reader.attempt("sweep", good).text
    write_hostile(kind, good, SWEEP_ARRAY, path, sealed=True)
    found = reader.attempt("sweep", path)
    check(found, path)
    assert found.outcome != "read" or found.text == expected
    listed = reader.attempt("sources", path)
    check(listed, path)
    if kind in GATHERED_KINDS:
        gathered = reader.attempt("gather", folder)
        check(gathered, path)
        assert gathered.outcome == "exit 0", gathered
        assert reader.attempt("sweep", path).text == expected


@pytest.mark.parametrize("kind", [kind for kind in KINDS if "config" not in kind])
def test_file_of_traces(reader, folder, kind):
    """The shard has the digest of the hostile file, so that only HDF5 can see what is wrong."""
    sweep = read_folder(folder)
    path = sweep.traces_file(0)
    assert reader.attempt("traces", folder).outcome == "read"
    write_hostile(kind, path, RUN_ARRAY, path, sealed=True)
    content = path.read_bytes()
    rewrite_shard(sweep, FileChecksum(seal_digest(content), len(content)))
    # What can be read is trusted here: the digests of the file and of the shard are right.
    check(reader.attempt("traces", folder), path)


def rewrite_shard(sweep, checksum):
    table = read_shard(sweep.shard_file(0), sweep.columns)
    attributes = {
        "plan_id": table.attributes["plan_id"],
        "traces_digest": checksum.digest,
        "traces_bytes": checksum.size,
    }
    head = TableHeader(sweep.columns, 0, len(table[RUN]), attributes)
    write_shard(sweep.shard_file(0), head, {name: table[name] for name in sweep.columns})


@pytest.mark.long
@pytest.mark.parametrize("part", range(10))
def test_wrong_numbers_in_the_structure(reader, finished, tmp_path, part):
    path = tmp_path / "patched.h5"
    for way, good in (("run", STORED_RUN), ("sweep", finished / "sweep.h5")):
        content = good.read_bytes()[:-SEAL_SIZE]
        expected = reader.attempt(way, good).text
        for seed in range(100 * part, 100 * part + 100):
            harmed = patched(content, seed)
            for damaged in (add_seal(harmed), harmed):
                path.write_bytes(damaged)
                found = reader.attempt(way, path)
                check(found, path)
                assert found.outcome != "read" or found.text == expected, seed
