"""Protects reports in PDF, read back by an independent library."""

from dataclasses import replace

import pytest
from pypdf import PdfReader
from pypdf.generic import Destination
from report.writers.pdf_reports import FIGURE, read, report, table_of, text_of
from support.figure_runs import run_of, without_config

from rbstab.report.model.document import Cell, Head, Table, Unread
from rbstab.report.runs.sections import run_sections
from rbstab.report.writers import pdf_layout
from rbstab.report.writers.pdf import write_pdf

HOSTILE = ["{nb}", "**bold** __u__ ~~s~~", "<b>&amp;</b>", "[a](http://x)", "$x$", "(a\\b)", "%PDF"]


def test_everything_that_the_report_says_is_there():
    table = table_of(3, 2, note="Mind the gap.")
    unread = (Unread("results/b.h5", "it is damaged"),)
    reader = read(report("A paragraph with Θ, ω² and v'.", table, FIGURE, unread=unread))
    text = text_of(reader)
    for expected in (
        "A report",
        "Made 2026-01-02 03:04 by",
        "rbstab report a.h5 --pdf",
        "The first section",
        "A paragraph with Θ, ω² and v'.",
        "A table",
        "h1 [m]",
        "c1-2",
        "Mind the gap.",
        "Figure 1. A curve (as Fig. 3). It rises.",
        "Results that could not be read",
        "results/b.h5: it is damaged",
    ):
        assert expected in text, expected
    assert reader.metadata.title == "A report"


def test_pages_are_of_paper_and_numbered():
    reader = read(report(*["A paragraph of some length. " * 40] * 12))
    assert len(reader.pages) > 2
    for number, page in enumerate(reader.pages, start=1):
        width, height = page.mediabox.width, page.mediabox.height
        assert (round(width / 72 * 25.4), round(height / 72 * 25.4)) == (210, 297)
        assert page.extract_text().split()[-1] == str(number)


def test_the_outline_has_the_sections():
    reader = read(report("Words.", unread=(Unread("b", "c"),)))
    titles = [entry.title for entry in reader.outline if isinstance(entry, Destination)]
    assert titles == ["The first section", "The second", "Results that could not be read"]


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_are_plain(text):
    cell = ((Cell(text),),)
    table = Table("t", text, (Head(text),), cell, note=text)
    figure = replace(FIGURE, title=text, caption=text)
    found = text_of(read(report(text, table, figure, title=text)))
    assert found.count(text) == 8


def test_letters_that_the_type_lacks_are_marked(caplog, capfd):
    found = text_of(read(report("\ud800 連 a\tb\nc \x00 \x1b[31m")))
    assert "\N{REPLACEMENT CHARACTER} \N{REPLACEMENT CHARACTER} a b c" in found
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


def test_a_report_of_a_real_run(tmp_path):
    run = without_config(run_of("permanent"))
    path = tmp_path / "report.pdf"
    path.write_text("an older report")
    write_pdf(replace(report(), sections=run_sections([run])), path)
    reader = PdfReader(path)
    text = text_of(reader)
    assert "States and Lyapunov function: permanent (as the paper's Fig. 3)." in text
    assert sum(len(page.images) for page in reader.pages) == 6
    assert [entry.name for entry in tmp_path.iterdir()] == ["report.pdf"]


def test_an_older_report_stays_where_a_new_one_fails(tmp_path, monkeypatch):
    path = tmp_path / "report.pdf"
    path.write_text("an older report")

    def fails(figure):
        raise MemoryError

    monkeypatch.setattr(pdf_layout, "prepared", fails)
    with pytest.raises(MemoryError):
        write_pdf(report(FIGURE), path)
    assert path.read_text() == "an older report"
    assert len(list(tmp_path.iterdir())) == 1
