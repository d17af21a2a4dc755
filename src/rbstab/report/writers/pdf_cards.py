"""Cards of a PDF: boxes with the answers, so that they are read first."""

from collections.abc import Sequence
from io import BytesIO
from typing import NamedTuple

from fpdf.enums import MethodReturnValue, XPos, YPos

from rbstab.report.model.document import MARKS, Card, Cards, Sketch, Statement
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


SKETCH_WIDTH, ROW_SKETCH_WIDTH = 62.0, 38.0
"""Widths of a sketch in a card, and in a row, mm."""

ROWS_FROM = 4
"""With so many cards they are rows, as on the page: all answers are seen without turning a leaf."""


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

ENDS = Look(SMALL - 3, colour=GREY)
"""How the words at the ends of the axes of a sketch look."""

BESIDE, BELOW = 7.0, 2.6
"""Room for these words beside a sketch and below it, mm."""


def write_cards(pdf: ReportPdf, cards: Cards) -> None:
    """Write cards below each other, each on one page, and their note; many cards as rows."""
    pdf.ensure_orientation()
    write = _row if len(cards.cards) >= ROWS_FROM else _card
    for card in cards.cards:
        height = write(CardPen(pdf, dry_run=True), card)
        if pdf.will_page_break(height):
            pdf.add_page()
        _box(pdf, card, height)
        write(CardPen(pdf), card)
        pdf.ln(GAP / 2 if write is _row else GAP)
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

    def write(
        self, text: str, place: Place, look: Look = PLAIN, link: str = "", align: str = "L"
    ) -> float:
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
            align=align,
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
    tone = "bad" if card.alarm or "bad" in tones else tones[0]
    bar = TONE_COLOURS.get(tone, BORDER)
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
    y = _alarm(pen, card, Place(left, y, width))
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


def _row(pen: CardPen, card: Card) -> float:
    """Write the texts of a card with its sketch beside the answers; return its height, mm."""
    pdf = pen.pdf
    top, left = pdf.get_y(), pdf.l_margin + BAR + PADDING
    width = pdf.epw - BAR - 2 * PADDING
    link = f"#{card.target}" if card.target in pdf.anchors else ""
    beside = 0.0 if card.sketch is None else ROW_SKETCH_WIDTH + GAP
    answers = width - beside
    title = Place(left, top + PADDING / 2, answers)
    upper = pen.write(card.title, title, Look(TEXT, "B"), link)
    upper = _alarm(pen, card, title._replace(y=upper))
    column = answers / max(len(card.statements), 1)
    y = upper
    for number, statement in enumerate(card.statements):
        place = Place(left + number * column, upper, column - GAP)
        y = max(y, _statement(pen, statement, place))
    if card.sketch is not None:
        place = Place(left + answers + GAP, title.y, ROW_SKETCH_WIDTH)
        y = max(y, _row_sketch(pen, card.sketch, place))
    if card.facts:
        line = "; ".join(f"{name} {value}" for name, value in card.facts)
        y = pen.write(line, Place(left, y + 0.5, width), Look(SMALL - 1, colour=GREY))
    if not pen.dry_run:
        pdf.set_xy(pdf.l_margin, y + PADDING / 2)
    return y + PADDING / 2 - top


def _alarm(pen: CardPen, card: Card, place: Place) -> float:
    """Write what went wrong, if something did; return where it ends."""
    if not card.alarm:
        return place.y
    return pen.write(card.marked_alarm, place, Look(SMALL, colour=TONE_COLOURS["bad"]))


def _row_sketch(pen: CardPen, sketch: Sketch, place: Place) -> float:
    """Draw a sketch with its caption and the names of its curves below it; return its end."""
    _draw(pen, sketch, place)
    y = place.y + _height(place.width)
    y = pen.write(sketch.caption, place._replace(y=y + 0.5), Look(SMALL - 2, colour=GREY))
    return _curve_names(pen, sketch, place._replace(y=y))


def _statement(pen: CardPen, statement: Statement, place: Place) -> float:
    """Write a question with its answer; return where it ends."""
    colour = TONE_COLOURS.get(statement.tone, BLACK)
    y = pen.write(statement.question, place, Look(SMALL, colour=GREY))
    marked = f"{MARKS.get(statement.tone, '')} {statement.word}".strip()
    y = pen.write(marked, place._replace(y=y), Look(TEXT, "B", colour))
    return pen.write(f"{statement.sentence}.", place._replace(y=y))


def _sketch(pen: CardPen, sketch: Sketch, place: Place) -> float:
    """Draw a sketch with its caption beside it, in the colours of its curves; return its end."""
    _draw(pen, sketch, place._replace(width=SKETCH_WIDTH))
    beside = Place(place.x + SKETCH_WIDTH + GAP, place.y, place.width - SKETCH_WIDTH - GAP)
    y = pen.write(sketch.caption, beside, Look(SMALL - 1, colour=GREY))
    y = _curve_names(pen, sketch, beside._replace(y=y))
    return max(y, place.y + _height(SKETCH_WIDTH))


def _draw(pen: CardPen, sketch: Sketch, place: Place) -> None:
    """Draw a sketch with the words at the ends of its axes, unless the pen only measures."""
    if pen.dry_run:
        return
    x, width = place.x + BESIDE, place.width - BESIDE
    pen.pdf.image(BytesIO(svg(sketch).encode()), x, place.y, width, alt_text=sketch.words)
    low = place.y + width * ASPECT
    for text, y in zip(sketch.y_ends, (low - BELOW, place.y), strict=True):
        pen.write(text, Place(place.x, y, BESIDE), ENDS, align="R")
    for text, align in zip(sketch.x_ends, "LR", strict=True):
        pen.write(text, Place(x, low, width), ENDS, align=align)


def _height(width: float) -> float:
    """Return the height of a sketch with the words below it, mm."""
    return (width - BESIDE) * ASPECT + BELOW


def _curve_names(pen: CardPen, sketch: Sketch, place: Place) -> float:
    """Write the names of the curves of a sketch in their colours; return where they end."""
    y = place.y
    for number, (label, _) in enumerate(sketch.curves):
        if label:
            y = pen.write(label, place._replace(y=y), Look(SMALL - 1, "B", rgb(number)))
    return y


def _facts(pen: CardPen, facts: Sequence[tuple[str, str]], place: Place) -> float:
    """Write facts side by side, each with its name above it; return where they end."""
    column = place.width / len(facts)
    ends = []
    for number, (name, value) in enumerate(facts):
        own = Place(place.x + number * column, place.y, column - 1)
        end = pen.write(name, own, Look(SMALL - 1, colour=GREY))
        ends.append(pen.write(value, own._replace(y=end)))
    return max(ends)
