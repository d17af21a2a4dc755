"""Protects reports in PDF, read back by an independent library."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from pypdf import PdfReader
from pypdf.generic import Destination
from support.figure_runs import run_of, without_config

from rbstab.report.model.document import (
    Animation,
    Card,
    Cards,
    Cell,
    Head,
    Report,
    Section,
    Sketch,
    Solid,
    Statement,
    Table,
    Unread,
)
from rbstab.report.model.figure import Axis, Figure, Line, Panel
from rbstab.report.runs.sections import run_sections
from rbstab.report.writers import pdf_layout
from rbstab.report.writers.pdf import pdf_of, write_pdf
from rbstab.report.writers.pdf_cards import BORDER
from rbstab.report.writers.pdf_tables import TONE_COLOURS
from rbstab.report.writers.sketches import HEIGHT

X = np.linspace(0, 1, 5)


def figure_of(power):
    panel = Panel(Axis("x"), Axis("y"), (Line(X, X**power),))
    return Figure("f", "A curve", (panel,), source="as Fig. 3", caption="It rises.")


FIGURE = figure_of(2)
HOSTILE = ["{nb}", "**bold** __u__ ~~s~~", "<b>&amp;</b>", "[a](http://x)", "$x$", "(a\\b)", "%PDF"]


def report(*blocks, title="A report", **options):
    sections = (Section("first", "The first section", blocks), Section("second", "The second", ()))
    return Report(title, "2026-01-02T03:04:05", "rbstab report a.h5 --pdf", sections, **options)


def read(made):
    return PdfReader(BytesIO(pdf_of(made)))


def text_of(reader):
    return " ".join(" ".join(page.extract_text() for page in reader.pages).split())


def text_starts(page):
    """Return the distance of the start of each text from the left edge, points."""
    found = []

    def visit(text, current, matrix, *_):
        if text.strip() and current[4] + matrix[4]:
            found.append(current[4] + matrix[4])

    page.extract_text(visitor_text=visit)
    return found


def table_of(columns, rows, width=8, **options):
    heads = [Head("name"), *(Head(f"h{c}", "m", numbers=True) for c in range(1, columns))]
    cells = [
        tuple(Cell(f"{'r' if c == 0 else 'c'}{r}-{c}".ljust(width, ".")) for c in range(columns))
        for r in range(rows)
    ]
    return Table("t", "A table", tuple(heads), tuple(cells), **options)


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


def test_figures_are_numbered_and_keep_their_captions():
    reader = read(report(*(figure_of(power) for power in range(1, 8))))
    text = text_of(reader)
    assert [text.count(f"Figure {number}. A curve") for number in range(1, 9)] == [1] * 7 + [0]
    for page in reader.pages:
        assert len(page.images) == page.extract_text().count("Figure ")


SOLID = Solid(np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 1, 2]]))
MOTION = Animation(
    "m",
    "case 1",
    X[:2],
    np.zeros((2, 3)),
    np.array([[1.0, 0, 0, 0], [0.8, 0.6, 0, 0]]),
    SOLID,
    np.array([0.0, 0, 0.4]),
    np.zeros(3),
    stills=(0, 1),
)


def test_a_motion_without_stills_is_left_out_with_a_sentence():
    motion = replace(MOTION, stills=())
    assert "animates the motion of case 1" in text_of(read(report(motion)))


def test_a_motion_is_shown_as_stills():
    reader = read(report(MOTION))
    (page,) = [page for page in reader.pages if page.images]
    assert len(page.images) == 1
    text = text_of(reader)
    assert "Motion of case 1: poses at the times shown." in text
    assert "green: anchor" in text


def test_the_first_block_of_a_section_is_a_motion_on_the_page_of_its_heading():
    for lines in range(14, 28, 2):
        sections = (
            Section("a", "Before", ("Line.",) * lines),
            Section("b", "The heading", (MOTION,)),
        )
        pages = read(replace(report(), sections=sections)).pages
        (page,) = [page for page in pages if "The heading" in page.extract_text()]
        assert len(page.images) == 1


def tall(rows, number):
    """Return a figure of rows of panels, so that one page holds a few of them."""
    panel = Panel(Axis("x"), Axis("y"), (Line(X, X**number),))
    return Figure(f"f-{number}", f"Curve {number}", (panel,) * rows)


def bottom_of(page):
    """Return the baseline of the lowest text but the page number, points from the lower edge."""
    found = []

    def visit(text, current, matrix, *_):
        if text.strip() and "Curve" in text:
            found.append(current[5] + matrix[5])

    page.extract_text(visitor_text=visit)
    return min(found)


def test_figures_fill_their_pages():
    # Three figures of this height fit on a page, with a quarter of it left in their natural height.
    reader = read(report(*(tall(2, number) for number in range(1, 8))))
    counts = [len(page.images) for page in reader.pages]
    full, *_ = counts
    assert full >= 2
    for page, count in zip(reader.pages, counts, strict=True):
        if page is not reader.pages[-1] and count == full:
            # The margin is 20 mm, and the caption has one line.
            assert bottom_of(page) / 72 * 25.4 < 20 + 15


def test_cards_are_boxes_with_the_answers():
    statements = (
        Statement("Does it rest?", "proved", "It comes to rest", "good"),
        Statement("Does every motion?", "not decided", "Nothing is known"),
    )
    card = Card("case 1", statements, (("v(0)", "12 J"), ("ended", "late")), target="second")
    many = Cards("answers", (card,) * 9, (("seen", "what the word means"),))
    after = table_of(3, 2)
    reader = read(report(many, after))
    text = text_of(reader)
    for expected in ("Does it rest?", "proved", "It comes to rest.", "12 J"):
        assert text.count(expected) == 9
    # No card is divided by the end of a page.
    for page in reader.pages:
        own = page.extract_text()
        assert own.count("Does it rest?") == own.count("12 J")
    assert "Seen: what the word means." in text
    links = [a.get_object() for page in reader.pages for a in page.get("/Annots", [])]
    assert {str(link["/Dest"]) for link in links} == {"second"}


def test_the_answers_of_five_runs_are_on_one_page():
    """Four or more cards are rows: the answers of the five variants are seen at once."""
    long = "The exact motion converges to the only rest state: it is in the certified region"
    statements = (
        Statement("From this start: does it come to rest?", "proved", long, "good"),
        Statement(
            "Do all motions that stay in the range end in one rest state?", "proved", long, "good"
        ),
    )
    curve = np.column_stack([X, X**2])
    sketch = Sketch("v(t)/v(0) from 1e-8 to 1, logarithmic, over 4 s.", (("", curve),))
    facts = tuple((name, "8894 J") for name in ("at rest", "v(0)", "peak", "angle"))
    cards = [Card(f"case {k}", statements, facts, sketch=sketch) for k in range(5)]
    first = read(report("One sentence.", Cards("answers", tuple(cards)))).pages[0].extract_text()
    for k in range(5):
        assert f"case {k}" in first
    assert first.count("at rest 8894 J") == first.count("over 4 s.") == 5


@pytest.mark.parametrize(
    ("tones", "bar"),
    [
        (("good", "good"), "good"),
        (("good", ""), "good"),
        (("", "good"), ""),
        (("good", "bad"), "bad"),
    ],
)
def test_the_bar_of_a_card_is_not_good_if_an_answer_is_bad(tones, bar):
    statements = tuple(Statement("Is it?", "word", "It says", tone) for tone in tones)
    content = read(report(Cards("c", (Card("case 1", statements),)))).pages[0].get_contents()
    assert content is not None
    colours = [line.split() for line in content.get_data().splitlines() if line.endswith(b" rg")]
    # The ground, then the bar; a PDF has parts of one in place of bytes.
    found = [255 * float(component) for component in colours[1][:3]]
    assert found == pytest.approx(TONE_COLOURS.get(bar, BORDER), abs=0.5)


def test_a_tone_has_a_mark_too():
    """A reader who does not see the colours has the marks of the page."""
    tones = ("good", "bad", "warning", "")
    rows = tuple((Cell(f"row {tone}"), Cell("entry", tone=tone)) for tone in tones)
    table = Table("t", "T", (Head("a"), Head("b")), rows)
    card = Card("case 1", tuple(Statement("Is it?", "word", "It says", tone) for tone in tones))
    text = text_of(read(report(table, Cards("c", (card,)))))
    for word in ("entry", "word"):
        assert [f"{mark} {word}" in text for mark in "✓✗!"] == [True] * 3
    assert text.count("entry") == text.count("word") == 4


def test_the_sketch_of_a_card_is_drawn_beside_its_caption():
    curve = np.column_stack([X, X**2])
    sketch = Sketch("Drawn for a test.", (("red", curve), ("blue", curve)))
    made = [read(report(Cards("c", (Card("case 1", (), sketch=s),)))) for s in (None, sketch)]
    without, reader = made
    text = text_of(reader)
    for expected in ("Drawn for a test.", "red", "blue"):
        assert expected in text
        assert expected not in text_of(without)
    content = reader.pages[0].get_contents()
    assert content is not None
    # The frame and two curves are three strokes, and x = 3/4 is 225 of 300.
    assert content.get_data().split().count(b"S") == 3
    assert content.get_data().count(f" 225 {HEIGHT * (1 - 0.75**2):g} l".encode()) == 2


def test_the_ground_of_cards_does_not_colour_later_tables():
    card = Cards("answers", (Card("case 1", ()),))
    filled = [pdf_of(report(*blocks)) for blocks in ((table_of(3, 9),), (card, table_of(3, 9)))]
    contents = [PdfReader(BytesIO(made)).pages[0].get_contents() for made in filled]
    pages = [content.get_data() for content in contents if content is not None]
    # A card is two rectangles; a filled table would have one for each of its cells.
    assert pages[1].count(b" re f") - pages[0].count(b" re f") == 2


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


def test_a_heading_stands_on_the_page_of_its_first_figure():
    for lines in range(12, 24, 3):
        sections = (
            Section("a", "Before", ("Line.",) * lines),
            Section("b", "The heading", (FIGURE,)),
        )
        pages = read(replace(report(), sections=sections)).pages
        (page,) = [page for page in pages if "The heading" in page.extract_text()]
        assert "Figure 1." in page.extract_text()
        assert len(page.images) == 1


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
