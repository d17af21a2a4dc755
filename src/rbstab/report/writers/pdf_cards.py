"""Cards of a PDF: boxes with the answers, so that they are read first."""

from collections.abc import Sequence
from io import BytesIO
from typing import NamedTuple

from fpdf.enums import MethodReturnValue, XPos, YPos

from rbstab.report.model.document import Card, Cards, Sketch, Statement
from rbstab.report.model.palette import rgb
from rbstab.report.writers.pdf_pages import BLACK, FAMILY, GREY, LEADING, SMALL, TEXT, ReportPdf
from rbstab.report.writers.pdf_tables import TONE_COLOURS
from rbstab.report.writers.sketches import ASPECT, svg

PADDING = 3.0
"""Space between the border of a card and its texts, mm."""

GAP = 3.0
"""Space between cards, and between the columns of a card, mm."""

GROUND, BORDER = (245, 247, 249), (190, 198, 206)
"""Colours of a card."""

BAR = 1.2
"""Width of the coloured bar at the left of a card, mm."""


SKETCH_WIDTH = 62.0
"""Width of a sketch, mm."""


class Place(NamedTuple):
    """Where a text is: its left and upper end, and its width, mm."""

    x: float
    y: float
    width: float


class Look(NamedTuple):
    """How a text looks: its size, points, its style, and its colour."""

    size: float = SMALL
    style: str = ""
    colour: tuple[int, int, int] = BLACK


PLAIN = Look()


def write_cards(pdf: ReportPdf, cards: Cards) -> None:
    """Write cards below each other, each on one page, and their note."""
    pdf.ensure_orientation()
    for card in cards.cards:
        height = _card(CardPen(pdf, dry_run=True), card)
        if pdf.will_page_break(height):
            pdf.add_page()
        _box(pdf, card, height)
        _card(CardPen(pdf), card)
        pdf.ln(GAP)
    if cards.note:
        pdf.paragraph(cards.note, size=SMALL, colour=GREY)


class CardPen:
    """Writes the texts of a card, or only measures them.

    Args:
        pdf: The document.
        dry_run: Whether the texts are only measured.
    """

    def __init__(self, pdf: ReportPdf, *, dry_run: bool = False) -> None:
        self.pdf, self.dry_run = pdf, dry_run

    def write(self, text: str, place: Place, look: Look = PLAIN, link: str = "") -> float:
        """Write a text at a place; return where it ends, mm from the top of the page."""
        pdf, margin = self.pdf, self.pdf.c_margin
        pdf.set_font(FAMILY, look.style, look.size)
        pdf.set_text_color(*look.colour)
        # The texts of a card are aligned with its bar, without the space of fpdf2's cells.
        pdf.c_margin = 0.0
        if not self.dry_run:
            pdf.set_xy(place.x, place.y)
        height = pdf.multi_cell(
            place.width,
            LEADING * look.size,
            pdf.plain(text),
            align="L",
            link=link,
            dry_run=self.dry_run,
            output=MethodReturnValue.HEIGHT,
            new_x=XPos.LMARGIN,
            new_y=YPos.NEXT,
        )
        pdf.c_margin = margin
        assert isinstance(height, float)
        return place.y + height


def _box(pdf: ReportPdf, card: Card, height: float) -> None:
    """Draw the ground of a card, and a bar in the colour of its first answer, or of a bad one."""
    tones = [statement.tone for statement in card.statements] or [""]
    bar = TONE_COLOURS.get("bad" if "bad" in tones else tones[0], BORDER)
    # The context resets the colour: fpdf2 would fill the cells of later tables with it.
    with pdf.local_context():
        for colour, width in ((GROUND, pdf.epw), (bar, BAR)):
            pdf.set_fill_color(*colour)
            pdf.rect(pdf.l_margin, pdf.get_y(), width, height, style="F")


def _card(pen: CardPen, card: Card) -> float:
    """Write the texts of a card; return its height, mm."""
    pdf = pen.pdf
    top, left = pdf.get_y(), pdf.l_margin + BAR + PADDING
    width = pdf.epw - BAR - 2 * PADDING
    link = f"#{card.target}" if card.target in pdf.anchors else ""
    y = pen.write(card.title, Place(left, top + PADDING, width), Look(TEXT + 1, "B"), link)
    column = width / max(len(card.statements), 1)
    places = [
        Place(left + number * column, y + 1, column - GAP) for number in range(len(card.statements))
    ]
    ends = [_statement(pen, *pair) for pair in zip(card.statements, places, strict=True)]
    y = max(ends, default=y)
    if card.sketch is not None:
        y = _sketch(pen, card.sketch, Place(left, y + 2, width))
    if card.facts:
        y = _facts(pen, card.facts, Place(left, y + 2, width))
    if not pen.dry_run:
        pdf.set_xy(pdf.l_margin, y + PADDING)
    return y + PADDING - top


def _statement(pen: CardPen, statement: Statement, place: Place) -> float:
    """Write a question with its answer; return where it ends."""
    colour = TONE_COLOURS.get(statement.tone, BLACK)
    y = pen.write(statement.question, place, Look(SMALL, colour=GREY))
    y = pen.write(statement.word, place._replace(y=y), Look(TEXT, "B", colour))
    return pen.write(f"{statement.sentence}.", place._replace(y=y))


def _sketch(pen: CardPen, sketch: Sketch, place: Place) -> float:
    """Draw a sketch with its caption beside it, in the colours of its curves; return its end."""
    if not pen.dry_run:
        picture = BytesIO(svg(sketch).encode())
        pen.pdf.image(picture, place.x, place.y, SKETCH_WIDTH, alt_text=sketch.caption)
    beside = Place(place.x + SKETCH_WIDTH + GAP, place.y, place.width - SKETCH_WIDTH - GAP)
    y = pen.write(sketch.caption, beside, Look(SMALL - 1, colour=GREY))
    for number, (label, _) in enumerate(sketch.curves):
        if label:
            y = pen.write(label, beside._replace(y=y), Look(SMALL - 1, "B", rgb(number)))
    return max(y, place.y + SKETCH_WIDTH * ASPECT)


def _facts(pen: CardPen, facts: Sequence[tuple[str, str]], place: Place) -> float:
    """Write facts side by side, each with its name above it; return where they end."""
    column = place.width / len(facts)
    ends = []
    for number, (name, value) in enumerate(facts):
        own = Place(place.x + number * column, place.y, column - 1)
        end = pen.write(name, own, Look(SMALL - 1, colour=GREY))
        ends.append(pen.write(value, own._replace(y=end)))
    return max(ends)
