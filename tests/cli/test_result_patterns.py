"""Protects shell patterns such as `results/*` in place of results: proofs, reports, figures, notes
and the parts of a sweep beside the results are left out; what may be meant as a result is not.
"""

from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke
from support.made_runs import made_config, made_file
from support.printed_paths import printed

from rbstab_cli.arguments.results import results_among

BESIDE = (
    *("proofs/1.json", "notes_files/still.png", "notes.md", "README.md", "figure.svg"),
    *("figure.csv", "old.pdf", "old.html", "log.txt"),
)


@pytest.fixture
def mixed(folder: Path) -> Path:
    """A folder with two runs, a sweep, and files that stand beside them."""
    for name in (*BESIDE, "light.h5", "heavy.h5", "plan/manifest.json", "plan/members.h5"):
        path = folder / "mixed" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("text")
    return Path("mixed")


def named(folder: Path) -> list[Path]:
    """Return everything in a folder, as the shell names it for `folder/*`."""
    return sorted(folder.iterdir())


def test_what_stands_beside_results_is_left_out(
    mixed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = [mixed / name for name in ("heavy.h5", "light.h5", "plan")]
    assert list(results_among(named(mixed))) == results
    (note,) = capsys.readouterr().err.splitlines()
    assert note.startswith(printed("Left out, not a result: mixed/README.md, "))
    assert list(results_among(named(mixed), quiet=True)) == results
    assert capsys.readouterr().err == ""


def test_the_parts_of_a_sweep_are_left_out(mixed: Path) -> None:
    sweep = mixed / "plan"
    (sweep / "plan.yaml").write_text("base: good.yaml\nvary: {}\n")
    (sweep / "shards").mkdir()
    assert results_among(named(sweep), quiet=True) == (sweep / "members.h5",)


@pytest.mark.parametrize("name", ["wrong.h5", "folder", "missing.h5", "mine.txt", "mine.yaml"])
def test_what_may_be_meant_as_a_result_is_not_left_out(mixed: Path, name: str) -> None:
    """A damaged file, a folder, a file that does not exist, and a config of any name."""
    if name == "folder":
        Path(name).mkdir()
    elif name != "missing.h5":
        Path(name).write_text(GOOD)
    assert results_among([mixed / "light.h5", Path(name)]) == (mixed / "light.h5", Path(name))


def test_a_report_of_a_pattern_that_names_the_older_report(folder: Path, rbstab: Invoke) -> None:
    """The report of before is replaced, and the command names what it is made from."""
    made_file(Path("made/run.h5"), made_config())
    Path("made/proofs").mkdir()
    page = Path("made/page.txt")
    assert rbstab("report", "made/run.h5", "-o", str(page)).exit_code == 0
    done = rbstab("report", *map(str, named(Path("made"))), "-o", str(page))
    assert done.exit_code == 0, done.stderr
    assert done.stderr.replace("\\", "/") == (
        "Left out, not a result: made/page.txt, made/proofs\n-> made/page.txt\n"
    )
    assert printed("rbstab report made/run.h5 -o made/page.txt") in " ".join(
        page.read_text().split()
    )
