"""Folders and shell patterns in place of results: what is taken, and what is said of the others."""

import shutil
from pathlib import Path

import pytest
from cli.conftest import GOOD, STORED, ended, json_of, rbstab, success
from support.made_runs import made_config, made_file
from support.printed_paths import printed
from support.stored_proofs import store_proof_of

from rbstab_cli.results import results_among


@pytest.fixture
def mixed(folder):
    """A folder with two runs, two sweeps of which one is not finished, and two proofs."""
    Path("mixed").mkdir()
    for name in ("embedded.h5", "range_left.h5"):
        shutil.copy(STORED / "runs" / name, "mixed")
        store_proof_of(STORED / "runs" / name, Path("mixed"))
    for name in ("finished_map", "begun_map"):
        shutil.copytree(STORED / "sweeps" / name, f"mixed/{name}")
    return Path("mixed")


def test_a_report_takes_the_results_in_a_folder(mixed):
    done = rbstab("report", "mixed", "--format", "text")
    assert (done.exit_code, done.stderr) == (
        0,
        printed("mixed: 2 runs and 2 sweeps\nLeft out, not finished: mixed/begun_map\n"),
    )
    assert "rbstab report mixed --format text" in done.stdout
    data = json_of("report", "mixed")
    assert data["title"] == "2 runs and 1 sweep"
    named = (f"mixed/{name}" for name in ("embedded.h5", "finished_map", "range_left.h5"))
    same = json_of("report", *named)
    assert same["sections"] == data["sections"]


def test_a_folder_of_proofs(mixed):
    before = {file.name for file in (mixed / "proofs").iterdir()}
    assert len(before) == 2
    rbstab("run", "good.yaml", "-q", "-o", "mixed")
    (name,) = {file.name for file in (mixed / "proofs").iterdir()} - before
    rows = json_of("show", "mixed/proofs")
    by_name = {row["proof"]: row for row in rows}
    assert len(by_name) == len(list((mixed / "proofs").iterdir()))
    assert by_name[name]["of"] == "A short run"
    assert "proved" in by_name[name]["says"]
    (mixed / "proofs" / name).write_text("{")
    table = success("show", "mixed/proofs")
    assert table.stdout.startswith(printed("mixed/proofs: stored proofs\n"))
    assert f"{name} is damaged" in table.stdout
    assert printed("It has stored proofs: rbstab show mixed/proofs.\n") in (
        rbstab("list", "mixed/proofs").stderr
    )


@pytest.mark.slow
def test_the_folder_above_the_results_stands_for_them(mixed):
    mixed.rename("results")
    (Path("results") / "broken.h5").write_text("text")
    plain, dot = rbstab("list"), rbstab("list", ".")
    assert plain.exit_code == dot.exit_code == 4
    # The ages may differ by a second.
    assert plain.stdout.split()[:20] == dot.stdout.split()[:20]
    assert printed("results/proofs has 2 files; rbstab show results/proofs") in dot.stdout
    plot = success("plot", ".")
    # What cannot be read hides no others.
    assert printed("results/broken.h5: has no seal of rbstab") in plot.stderr
    assert "runs-decay" in plot.stdout
    ended(4, "plot", ".", printed("results/broken.h5"))


BESIDE = (
    *("proofs/1.json", "notes_files/still.png", "notes.md", "README.md", "figure.svg"),
    *("figure.csv", "old.pdf", "old.html", "log.txt"),
)


@pytest.fixture
def beside(folder):
    """A folder with two runs, a sweep, and files that stand beside them."""
    for name in (*BESIDE, "light.h5", "heavy.h5", "plan/manifest.json", "plan/members.h5"):
        path = folder / "mixed" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("text")
    return Path("mixed")


def named(folder):
    """Return everything in a folder, as the shell names it for `folder/*`."""
    return sorted(folder.iterdir())


def test_what_stands_beside_results_is_left_out(beside, capsys):
    results = [beside / name for name in ("heavy.h5", "light.h5", "plan")]
    assert list(results_among(named(beside))) == results
    (note,) = capsys.readouterr().err.splitlines()
    assert note.startswith(printed("Left out, not a result: mixed/README.md, "))


def test_the_parts_of_a_sweep_are_left_out(beside):
    sweep = beside / "plan"
    (sweep / "plan.yaml").write_text("base: good.yaml\nvary: {}\n")
    (sweep / "shards").mkdir()
    assert results_among(named(sweep)) == (sweep / "members.h5",)


@pytest.mark.parametrize("name", ["wrong.h5", "folder", "missing.h5", "mine.txt", "mine.yaml"])
def test_what_may_be_meant_as_a_result_is_not_left_out(beside, name):
    """A damaged file, a folder, a file that does not exist, and a config of any name."""
    if name == "folder":
        Path(name).mkdir()
    elif name != "missing.h5":
        Path(name).write_text(GOOD)
    assert results_among([beside / "light.h5", Path(name)]) == (beside / "light.h5", Path(name))


def test_a_report_of_a_pattern_that_names_the_older_report(folder):
    """The report of before is replaced."""
    made_file(Path("made/run.h5"), made_config())
    Path("made/proofs").mkdir()
    page = Path("made/page.txt")
    success("report", "made/run.h5", "-o", str(page))
    done = success("report", *map(str, named(Path("made"))), "-o", str(page))
    assert done.stderr.replace("\\", "/") == (
        "Left out, not a result: made/page.txt, made/proofs\n-> made/page.txt\n"
    )
