"""Protects folders in place of results: what is taken from them, and what is said of the others."""

import json
import re
import shutil
from pathlib import Path

import pytest
from cli.conftest import Invoke
from support.printed_paths import printed
from support.stored_proofs import store_proof_of

STORED = Path(__file__).parents[1] / "formats/data/format_1"


@pytest.fixture
def mixed(folder: Path) -> Path:
    """A folder with two runs, two sweeps of which one is not finished, and two proofs."""
    Path("mixed").mkdir()
    for name in ("embedded.h5", "range_left.h5"):
        shutil.copy(STORED / "runs" / name, "mixed")
        store_proof_of(STORED / "runs" / name, Path("mixed"))
    for name in ("finished_map", "begun_map"):
        shutil.copytree(STORED / "sweeps" / name, f"mixed/{name}")
    return Path("mixed")


def test_a_report_takes_the_results_in_a_folder(mixed: Path, rbstab: Invoke) -> None:
    done = rbstab("report", "mixed", "--format", "text")
    assert (done.exit_code, done.stderr) == (
        0,
        printed("mixed: 2 runs and 2 sweeps\nLeft out, not finished: mixed/begun_map\n"),
    )
    assert "rbstab report mixed --format text" in done.stdout
    data = json.loads(rbstab("report", "mixed", "--json").stdout)
    assert data["title"] == "2 runs and 1 sweep"
    named = (f"mixed/{name}" for name in ("embedded.h5", "finished_map", "range_left.h5"))
    same = json.loads(rbstab("report", *named, "--json").stdout)
    assert same["sections"] == data["sections"]


def test_a_file_that_is_no_result_hides_no_others(mixed: Path, rbstab: Invoke) -> None:
    (mixed / "broken.h5").write_text("text")
    report = rbstab("report", "mixed", "--format", "text")
    assert report.exit_code == 4
    assert "mixed/broken.h5: has no seal of rbstab" in report.stderr
    assert "range_left" in report.stdout
    plot = rbstab("plot", "mixed")
    assert plot.exit_code == 0
    assert "mixed/broken.h5: has no seal of rbstab" in plot.stderr
    assert "runs-decay" in plot.stdout
    # A result that is named must be readable.
    assert rbstab("plot", "mixed", "mixed/broken.h5").exit_code == 4


def _without_ages(text: str) -> list[str]:
    return re.sub(r"\d+ (s|min|h|days?)\b", "", text).split()


def test_the_folder_above_the_results(mixed: Path, rbstab: Invoke) -> None:
    mixed.rename("results")
    dot = rbstab("list", ".")
    # The ages may differ by a second.
    plain, found = (_without_ages(done.stdout) for done in (rbstab("list"), dot))
    assert (dot.exit_code, found) == (0, plain)
    assert printed("results/proofs has 2 files; rbstab show results/proofs") in dot.stdout
    assert ".: 2 runs and 2 sweeps\n" in rbstab("plot", ".").stderr


def test_a_folder_of_proofs(mixed: Path, rbstab: Invoke) -> None:
    before = {file.name for file in (mixed / "proofs").iterdir()}
    assert len(before) == 2
    rbstab("run", "good.yaml", "-q", "-o", "mixed")
    (name,) = {file.name for file in (mixed / "proofs").iterdir()} - before
    rows = json.loads(rbstab("show", "mixed/proofs", "--json").stdout)
    by_name = {row["proof"]: row for row in rows}
    assert len(by_name) == len(list((mixed / "proofs").iterdir()))
    assert by_name[name]["of"] == "A short run"
    assert "proved" in by_name[name]["says"]
    (mixed / "proofs" / name).write_text("{")
    table = rbstab("show", "mixed/proofs")
    assert table.exit_code == 0
    assert table.stdout.startswith(printed("mixed/proofs: stored proofs\n"))
    assert f"{name} is damaged" in table.stdout
    assert printed("It has stored proofs: rbstab show mixed/proofs.\n") in (
        rbstab("list", "mixed/proofs").stderr
    )


def test_folders_inside_of_a_sweep(mixed: Path, rbstab: Invoke) -> None:
    shards = json.loads(rbstab("show", "mixed/begun_map/shards", "--json").stdout)
    assert [row["file"] for row in shards] == sorted(
        file.name for file in (mixed / "begun_map/shards").iterdir()
    )
    assert shards[0]["members"] == "0 to 7"
    assert "shards of a sweep\n" in rbstab("show", "mixed/begun_map/shards").stdout
    shutil.copytree(STORED / "sweeps/finished_variants", "mixed/variants")
    traces = json.loads(rbstab("show", "mixed/variants/traces", "--json").stdout)
    assert traces[0]["file"] == "00000000.h5"
