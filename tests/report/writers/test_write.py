"""Protects the writing of reports: complete files that replace older reports and nothing else."""

import os

import pytest
from support.made_runs import made_file
from support.made_sweeps import GRID, write_sweep

from rbstab.report.build import MAX_ANIMATIONS, report_of
from rbstab.report.model.document import (
    Animation,
    Cards,
    Report,
    Section,
    Table,
)
from rbstab.report.reading.sources import read_sources
from rbstab.report.writers.signature import is_report
from rbstab.report.writers.write import SUFFIXES, write_report
from rbstab.store.errors import ResultExistsError, StoreError

FORMATS = sorted(set(SUFFIXES.values()))

SMALL = Report(
    "A report",
    "2026-01-01",
    "rbstab report",
    (Section("s", "A section", ("Some words.",)),),
)


@pytest.mark.parametrize("form", FORMATS)
def test_a_report_is_known_to_be_one_and_gives_way(form, tmp_path):
    path = tmp_path / "new" / "folder" / "report"
    write_report(SMALL, path, form)
    first = path.read_bytes()
    assert is_report(path)
    write_report(SMALL, path, form)
    assert len(path.read_bytes()) == pytest.approx(len(first), abs=100)
    assert [p.name for p in path.parent.iterdir()] == ["report"]


@pytest.mark.parametrize("content", [b"", b"title: mine\n", b"made by rbstab report, I think\n"])
@pytest.mark.parametrize("form", FORMATS)
def test_what_is_no_report_is_kept(content, form, tmp_path):
    path = tmp_path / "report"
    path.write_bytes(content)
    with pytest.raises(ResultExistsError, match=r"is not a report\. Use --force"):
        write_report(SMALL, path, form)
    assert path.read_bytes() == content
    write_report(SMALL, path, form, force=True)
    assert is_report(path)


@pytest.mark.parametrize("form", FORMATS)
def test_a_disk_that_fails_leaves_the_old_report(form, tmp_path, monkeypatch):
    path = tmp_path / "report"
    write_report(SMALL, path, form)
    before = path.read_bytes()

    def fail(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(StoreError, match="No space left on device"):
        write_report(SMALL, path, form)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["report"]


def names_of(report):
    return [section.name for section in report.sections]


def test_the_parts_of_a_report(tmp_path):
    paths = [made_file(tmp_path / f"{k}.h5", title=f"Run {k}") for k in range(2)]
    report = report_of(read_sources(paths), "rbstab report")
    shown = ["summary", "motion", "figures", "runs", "differences"]
    folded = ["certificates", "config", "provenance"]
    assert names_of(report) == [*shown, *folded]
    assert [section.name for section in report.sections if section.folded] == folded
    blocks = [block for section in report.sections for block in section.blocks]
    names = [block.name for block in blocks if not isinstance(block, str)]
    assert len(set(names)) == len(names)
    assert report.title == "2 runs"
    alone = report_of(read_sources(paths[:1]), "")
    assert names_of(alone) == [*shown[:-1], *folded]
    assert alone.title == "Run 0"
    assert report_of(read_sources(paths), "", "My\u202e title").title == "My\\u202e title"


def test_what_is_wrong_comes_right_after_the_answers(tmp_path):
    paths = [made_file(tmp_path / f"{k}.h5", warnings="one") for k in range(2)]
    assert names_of(report_of(read_sources(paths), ""))[:2] == ["summary", "warnings"]


def test_answers_of_sweeps_stand_with_those_of_runs(tmp_path):
    run = made_file(tmp_path / "a.h5")
    sweeps = [write_sweep(tmp_path / name / "members.h5", GRID).path for name in ("one", "two")]
    (first, *_) = report_of(read_sources([run, *sweeps]), "").sections
    assert first.name == "summary"
    # The card of a sweep says what a sentence would.
    assert [isinstance(block, str) for block in first.blocks] == [True] + [False] * 2
    assert str(first.blocks[0]).startswith("Run a: Rests elsewhere: at (")
    cards = [card for block in first.blocks if isinstance(block, Cards) for card in block.cards]
    assert [card.title for card in cards] == ["a", "one", "two"]
    returns = "Returns: 20 of 20 members. Seen, not proved. Desired: upright (default), within 10°."
    assert cards[-1].statements[0].sentence == returns
    # A sweep alone needs no card: its section begins with the sentence.
    (alone, *_) = report_of(read_sources(sweeps[:1]), "").sections
    assert (alone.name, alone.blocks[0]) == ("sweep-1", returns)


def test_only_the_first_runs_move(tmp_path):
    paths = [made_file(tmp_path / f"{k}.h5") for k in range(MAX_ANIMATIONS + 1)]
    report = report_of(read_sources(paths), "")
    [motion] = [section for section in report.sections if section.name == "motion"]
    assert sum(isinstance(block, Animation) for block in motion.blocks) == MAX_ANIMATIONS
    assert motion.blocks[0] == (
        f"Shown: {MAX_ANIMATIONS} of {MAX_ANIMATIONS + 1} runs. Not shown: {MAX_ANIMATIONS}."
    )


def test_links_inside_a_report_lead_somewhere(tmp_path):
    report = report_of(read_sources([made_file(tmp_path / "a.h5")]), "")
    targets = {
        cell.target
        for section in report.sections
        for block in section.blocks
        if isinstance(block, Table)
        for row in block.rows
        for cell in row
    }
    assert targets - {""} <= set(names_of(report))
