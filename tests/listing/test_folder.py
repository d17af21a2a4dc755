"""Protects the list of a folder of results: each run and sweep once, with its own words; what
cannot be read is named and hides nothing.
"""

import os
import shutil
from pathlib import Path
from typing import Any

import h5py
import pytest
from support.results import flip, sealed
from support.stored_proofs import say_proved, store_proof_of

from rbstab.listing.folder import entries_of, proofs_in
from rbstab.report.reading.kinds import Kind
from rbstab.store.disk.seal import SEAL_SIZE
from rbstab.store.result import open_result, write_result

STORED = Path(__file__).parents[1] / "formats/data/format_1"


@pytest.fixture
def folder(tmp_path):
    """A folder with two runs, two sweeps, proofs, and files that are no results."""
    for name in ("embedded", "range_left"):
        shutil.copy(STORED / f"runs/{name}.h5", tmp_path)
    for name in ("finished_variants", "begun_map"):
        shutil.copytree(STORED / f"sweeps/{name}", tmp_path / name)
    say_proved(tmp_path / "finished_variants", (2, 3, 11))
    (tmp_path / "proofs").mkdir()
    for digit in "01":
        (tmp_path / f"proofs/{digit * 32}.json").write_text("{}")
    (tmp_path / "report.html").write_text("<html>")
    (tmp_path / ".hidden.h5").write_text("x")
    (tmp_path / "other").mkdir()
    return tmp_path


def by_name(folder):
    return {entry.path.name: entry for entry in entries_of(folder)}


def test_each_run_and_sweep_is_listed_once(folder):
    names = ["begun_map", "embedded.h5", "finished_variants", "range_left.h5"]
    assert sorted(by_name(folder)) == names
    assert len(proofs_in(folder)) == 2
    assert proofs_in(folder / "other") == []


def test_what_they_say_of_themselves(folder):
    entries = by_name(folder)
    run = entries["range_left.h5"]
    assert run[1:6] == (Kind.RUN, "Stored", "left the range", "range left", "consistent")
    assert (run.converges, run.this_start, run.whole_range) == ("not decided",) * 3
    assert entries["finished_variants"].status == "20 of 20 completed"
    assert entries["finished_variants"].outcome.endswith(" of 20 return")
    assert entries["finished_variants"].converges == "3 of 20 proved"
    assert entries["finished_variants"].this_start == "3 of 20 proved"
    assert entries["begun_map"].status == "2 of 4 shards are stored"
    assert entries["begun_map"].kind is Kind.SWEEP


def test_a_run_beside_a_proof_of_its_body(folder):
    """Its own motion left the range."""
    store_proof_of(STORED / "runs/range_left.h5", folder)
    run = by_name(folder)["range_left.h5"]
    assert (run.this_start, run.whole_range) == ("not decided", "returns: proved")


def test_a_proved_run(folder):
    result = open_result(folder / "embedded.h5")
    result.attributes["convergence"] = "proved"
    write_result(folder / "proved.h5", result)
    entry = by_name(folder)["proved.h5"]
    assert entry.converges == entry.this_start == "proved"


def test_a_run_whose_answer_cannot_be_found_is_listed(folder):
    result = open_result(folder / "embedded.h5")
    result.attributes["convergence"] = "perhaps"
    write_result(folder / "odd.h5", result)
    entry = by_name(folder)["odd.h5"]
    assert (entry.status, entry.this_start, entry.problem) == ("completed", "-", "")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_changed_byte_of_a_sealed_run_is_found(folder, share):
    file = folder / "sealed.h5"
    write_result(file, open_result(folder / "range_left.h5"))
    flip(file, share)
    assert "is damaged" in by_name(folder)["sealed.h5"].problem


def test_an_attribute_that_is_missing_is_named(folder):
    result = open_result(folder / "range_left.h5")
    del result.attributes["engine"]
    write_result(folder / "poor.h5", result)
    assert by_name(folder)["poor.h5"].problem.endswith("is damaged: engine is missing")


def changed(file, column, value):
    """Change the first byte of a column, and seal the file again."""
    content = bytearray(file.read_bytes()[:-SEAL_SIZE])
    with h5py.File(file) as opened:
        dataset: Any = opened[column]
        content[dataset.id.get_offset()] = value
    file.write_bytes(sealed(bytes(content)))


def test_what_is_listed_is_checked(folder):
    shard = folder / "finished_variants/shards/00000001.h5"
    changed(shard, "status", 99)
    problem = by_name(folder)["finished_variants"].problem
    assert problem == f"{shard} is damaged: status has a flag without a meaning"


def test_a_run_in_place_of_the_file_of_a_sweep(folder):
    shutil.copy(folder / "embedded.h5", folder / "finished_variants/members.h5")
    problem = by_name(folder)["finished_variants"].problem
    assert "is the result of a run, not what is known of the members of a sweep" in problem


def test_the_newest_comes_first(folder):
    os.utime(folder / "embedded.h5", (2e9, 2e9))
    os.utime(folder / "range_left.h5", (1e9, 1e9))
    names = [entry.path.name for entry in entries_of(folder)]
    assert names[0] == "embedded.h5"
    assert names[-1] == "range_left.h5"
    assert by_name(folder)["embedded.h5"].modified == 2e9


def test_what_cannot_be_read_is_named_and_hides_nothing(folder):
    (folder / "broken.h5").write_text("x")
    (folder / "finished_variants/manifest.json").write_text("{")
    entries = by_name(folder)
    assert len(entries) == 5
    assert entries["broken.h5"].problem.startswith(
        f"{folder / 'broken.h5'} has no seal of rbstab: "
    )
    assert "is damaged" in entries["finished_variants"].problem
    assert [name for name, entry in entries.items() if entry.problem == ""]


def test_a_sweep_lists_itself(folder):
    (entry,) = entries_of(folder / "begun_map")
    assert entry.title == "A map over spin, stored by rbstab 0.1.0"


def test_a_sweep_without_proofs_says_so(folder):
    sweep = folder / "finished_variants"
    shutil.copy(STORED / "sweeps/finished_variants/members.h5", sweep)
    shutil.rmtree(folder / "proofs")
    entry = by_name(folder)["finished_variants"]
    assert (entry.converges, entry.this_start, entry.whole_range) == ("-", "not proved", "-")
