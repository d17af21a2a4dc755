"""The proofs page: functions that check hypotheses exist, and its numbers are what is printed."""

import re
from functools import cache

import pytest
from click.testing import CliRunner
from support.documents import ROOT, names_in, page, tables

from rbstab_cli.main import cli

SOURCE = ROOT / "src" / "rbstab"
PAGE, IN_FULL = page("proofs"), page("proofs_in_full")

NAMED = re.compile(r"`([A-Za-z_][\w.]*)`")
PATH = re.compile(r"`([\w/]+\.py)`")


def rows(*header):
    """Return the cells of all tables with these columns."""
    return [row for head, *rows in tables(PAGE) if head == list(header) for row in rows]


def printed_by(folder, *arguments):
    """Return what a command prints; proofs are made, and stored in a folder."""
    done = CliRunner().invoke(cli, [*arguments, "--results", str(folder)], prog_name="rbstab")
    assert done.exit_code == 0, done.output
    return done.stdout


@cache
def all_names():
    return frozenset().union(*(names_in(path) for path in SOURCE.rglob("*.py")))


CHECKED_BY = [row[-1] for row in rows("", "hypothesis", "checked by")]
LINES = [line for line in PAGE.splitlines() if PATH.search(line)]


def test_each_theorem_has_its_hypotheses():
    assert len(CHECKED_BY) >= 30
    numbers = re.findall(r"^(?:## |\*\*)Theorem (\d+)", PAGE, re.MULTILINE)
    assert [int(number) for number in numbers] == list(range(1, 17))
    assert len(re.findall(r"^\*\*Statement\.\*\*", PAGE, re.MULTILINE)) == 15


@pytest.mark.parametrize("cell", CHECKED_BY)
def test_each_function_that_checks_a_hypothesis_exists(cell):
    assert set(NAMED.findall(PATH.sub("", cell))) <= all_names()


@pytest.mark.parametrize("line", LINES, ids=lambda line: line[:40])
def test_each_function_is_in_the_module_that_is_named_beside_it(line):
    for name, path in re.findall(r"`([A-Za-z_][\w.]*)`(?: of| \(|, )`([\w/]+\.py)`", line):
        assert name in names_in(SOURCE / path), (name, path)
    for path in PATH.findall(line):
        assert (SOURCE / path).is_file(), path


def test_theorems_that_code_names_are_on_the_page():
    files = [*SOURCE.rglob("*.py"), *(ROOT / "cli").rglob("*.py"), *(ROOT / "docs").glob("*.md")]
    named = {
        int(number)
        for path in files
        for number in re.findall(r"[Tt]heorem (\d+)", path.read_text(encoding="utf-8"))
    }
    assert named <= set(range(1, 17))


def test_the_page_is_short():
    assert len(PAGE.split()) <= 6_500
    assert len(IN_FULL.split()) <= 12_700


@pytest.mark.heavy
@pytest.mark.parametrize(
    "row",
    rows("config", "v(0) [J]", "inside from t [s]", "v there [J]", "level [J]"),
    ids=lambda row: row[0],
)
def test_the_motions_are_what_is_printed(row, tmp_path):
    name, start, time, there, level = row
    config = str(ROOT / "configs" / "paper" / f"{name}.yaml")
    printed = printed_by(tmp_path, "stability", config, "--no-run")
    assert f"This start: {start} J above" in printed
    assert f"from t = {time} s (v = {there} J < {level} J," in printed


@pytest.mark.heavy
@pytest.mark.parametrize(("level", "name"), re.findall(r"(\d+) J \((case\w+)\)", PAGE))
def test_the_levels_of_all_bodies_are_what_is_printed(level, name, tmp_path):
    within = ("--within", "controller=±20%", "--within", "body.contact_point=±0.01")
    config = str(ROOT / "configs" / "paper" / f"{name}.yaml")
    printed = printed_by(tmp_path, "stability", config, *within, "--no-run")
    (printed_level,) = re.findall(
        r"every motion with v\(0\) < ([\d.]+) J converges, proved", printed
    )
    assert int(float(printed_level)) == int(level)


@pytest.mark.heavy
@pytest.mark.parametrize(
    "row",
    rows("tilt [rad]", "case 1: proved, found to break [N m]", "case 2"),
    ids=lambda row: row[0],
)
def test_the_largest_couples_are_what_is_printed(row, tmp_path):
    tilt, *cases = row
    asked = ("--bound", "couple=100", "--within-tilt", tilt, "--largest", "--no-run")
    for name, couples in zip(("case1_permanent", "case2_visco_elastic"), cases, strict=True):
        config = str(ROOT / "configs" / "paper" / f"{name}.yaml")
        printed = printed_by(tmp_path, "stability", config, *asked)
        proved, broken = couples.split(", ")
        assert f"Largest disturbance: couple up to {proved} N m, proved" in printed
        assert f"couple up to {broken} N m was found to break it" in printed
