"""Protects the cards of PDF reports."""

from io import BytesIO

import numpy as np
import pytest
from pypdf import PdfReader
from report.writers.pdf_reports import X, read, report, table_of, text_of

from rbstab.report.model.document import Card, Cards, Cell, Head, Sketch, Statement, Table
from rbstab.report.writers.pdf import pdf_of
from rbstab.report.writers.pdf_cards import BORDER
from rbstab.report.writers.pdf_tables import TONE_COLOURS
from rbstab.report.writers.sketches import HEIGHT


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
        Statement("From the whole range: where does it come to rest?", "proved", long, "good"),
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
    curves = (("red", curve), ("blue", curve))
    sketch = Sketch("Drawn for a test.", curves, x_ends=("0 s", "2 s"), y_ends=("-3", "7 J"))
    made = [read(report(Cards("c", (Card("case 1", (), sketch=s),)))) for s in (None, sketch)]
    without, reader = made
    text = text_of(reader)
    for expected in ("Drawn for a test.", "red", "blue", "0 s", "2 s", "-3", "7 J"):
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
