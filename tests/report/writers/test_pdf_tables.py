"""Protects the tables of PDF reports: they fit, have their heads, and are not broken in vain."""

from dataclasses import replace

import pytest
from report.writers.pdf_reports import read, report, table_of, text_of

from rbstab.report.model.document import Cell, Head, Section, Table


def text_starts(page):
    """Return the distance of the start of each text from the left edge, points."""
    found = []

    def visit(text, current, matrix, *_):
        if text.strip() and current[4] + matrix[4]:
            found.append(current[4] + matrix[4])

    page.extract_text(visitor_text=visit)
    return found


def test_a_cell_leads_to_its_section():
    cells = ((Cell("there", target="second"), Cell("nowhere", target="no-such-section")),)
    reader = read(report(Table("t", "T", (Head("a"), Head("b")), cells)))
    (link,) = [a.get_object() for page in reader.pages for a in page.get("/Annots", [])]
    assert link["/Subtype"] == "/Link"
    assert str(link["/Dest"]) == "second"
    assert "second" in reader.named_destinations


def test_the_heads_of_a_table_stand_on_each_of_its_pages():
    reader = read(report(table_of(4, 120)))
    with_rows = [page.extract_text() for page in reader.pages if "c" in page.extract_text()]
    pages = [text for text in with_rows if "-1." in text]
    assert len(pages) > 1
    assert all("h3 [m]" in text for text in pages)
    text = text_of(reader)
    assert all(f"r{row}-0" in text for row in range(120))


@pytest.mark.parametrize(
    ("columns", "rows", "lies", "heads"),
    [(5, 3, False, 1), (16, 3, False, 2), (40, 3, False, 5), (16, 30, True, 1), (40, 30, True, 3)],
)
def test_wide_tables_fit(columns, rows, lies, heads):
    reader = read(report("Before.", table_of(columns, rows, width=14), "After."))
    (first, *_), *_ = ([p for p in reader.pages if "c0-1" in p.extract_text()],)
    assert (first.mediabox.width > first.mediabox.height) == lies
    text = text_of(reader)
    for row in range(rows):
        for column in range(1, columns):
            assert f"c{row}-{column}." in text
    assert text.count("r0-0.") >= heads
    for page in reader.pages:
        assert all(0 < x < float(page.mediabox.width) - 40 for x in text_starts(page))
    after = [page for page in reader.pages if "After." in page.extract_text()]
    assert after[0].mediabox.width < after[0].mediabox.height


def test_a_table_stands_with_its_title():
    for lines in range(24, 34):
        reader = read(report(*["Line."] * lines, table_of(3, 3)))
        pages = [page.extract_text() for page in reader.pages]
        assert any("A table" in page and "r0-0" in page for page in pages)


def test_a_low_table_is_not_broken_between_pages():
    for lines in range(16, 40, 3):
        sections = (
            Section("a", "Before", ("Line.",) * lines),
            Section("b", "The heading", ("A sentence.", table_of(3, 8))),
        )
        pages = [page.extract_text() for page in read(replace(report(), sections=sections)).pages]
        (page,) = [page for page in pages if "A table" in page]
        assert "r0-0" in page
        assert "r7-0" in page
        assert "The heading" in page
        assert "A sentence." in page


@pytest.mark.parametrize("rows", [26, 49, 50, 51, 98, 99, 100, 101])
def test_each_page_of_a_high_table_has_some_rows_and_the_heads(rows):
    for lines in (0, 20, 27, 28, 29, 30, 31):
        pages = read(report(*["Line."] * lines, table_of(3, rows))).pages
        texts = [page.extract_text() for page in pages]
        counts = [text.count("-0.") for text in texts]
        assert sum(counts) == rows
        assert all(count == 0 or count >= 3 for count in counts), (lines, counts)
        assert all("h2 [m]" in text for text in texts if "-0." in text)
        (titled,) = [text for text in texts if "A table" in text]
        assert "r0-0" in titled


def test_the_low_parts_of_a_wide_table_are_not_broken():
    """Of the five parts of 12 rows, no two fit below the lines, but each fits on a page."""
    for lines in range(0, 30, 5):
        pages = read(report(*["Line."] * lines, table_of(40, 12, width=14))).pages
        for page in pages:
            text = page.extract_text()
            assert text.count("r0-0") == text.count("r11-0")


def test_a_long_text_in_a_wide_table_gets_a_wide_column():
    """Eight columns leave 28 mm for a text of 340 characters: some 14 lines in each row."""
    long = "; ".join(f"angular velocity[{n}] = 0.12345" for n in range(11))
    table = table_of(9, 3, width=10)
    heads = (*table.heads, Head("parameters"))
    rows = tuple((*row, Cell(long)) for row in table.rows)
    (page, *_) = read(report(replace(table, heads=heads, rows=rows))).pages
    lines = [line for line in page.extract_text().splitlines() if "angular" in line]
    assert 3 <= len(lines) <= 15
    assert page.extract_text().count("r0-0") == 2


def test_cells_that_no_page_could_hold_are_cut():
    table = Table("t", "T", (Head("a"), Head("b")), ((Cell("x" * 100_000), Cell("y " * 9000)),))
    assert "xxx" in text_of(read(report(table)))


def test_a_heading_stands_on_the_page_of_its_first_table():
    for columns in (5, 16):
        sections = (
            Section("a", "Before", ("Line.",)),
            Section("b", "The heading", (table_of(columns, 30, width=14),)),
        )
        pages = read(replace(report(), sections=sections)).pages
        (page,) = [page for page in pages if "The heading" in page.extract_text()]
        assert "c0-1" in page.extract_text()
        assert (page.mediabox.width > page.mediabox.height) == (columns == 16)
