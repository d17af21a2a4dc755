"""The pages of a PDF: fonts, headings with an outline, paragraphs, pictures with captions."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
from fpdf import FPDF
from fpdf.enums import MethodReturnValue, PageOrientation, XPos, YPos
from fpdf.fonts import TTFFont
from PIL import Image

FAMILY = "DejaVu Sans"

FONTS = {"": "DejaVuSans.ttf", "B": "DejaVuSans-Bold.ttf", "I": "DejaVuSans-Oblique.ttf"}
"""Font files of matplotlib by style; they have Greek letters and the symbols of the paper."""

MARGIN = 20.0
"""Margin of a page, mm."""

MOST_EMPTY = 0.3
"""The share of a page that a block may leave empty to stay whole."""

TEXT, SMALL, HEADING = 9.5, 8.0, 13.0
"""Font sizes, points."""

BLACK, GREY = (0, 0, 0), (95, 95, 95)

LEADING = 0.5
"""Line spacing over the font size, mm/point."""

REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
"""Replaces a character that the font does not have."""


class Picture(NamedTuple):
    """A picture: its width, mm, its caption, and its alternative text."""

    image: Image.Image
    width: float
    caption: str
    alt_text: str


class ReportPdf(FPDF):
    """The PDF document of a report.

    Args:
        title: The title of the report.
        anchors: The names of the sections that links may target.
    """

    def __init__(self, title: str, anchors: Sequence[str] = ()) -> None:
        super().__init__(format="A4")
        # fpdf2 would otherwise replace "{nb}" in the texts of the report by the number of pages.
        self.str_alias_nb_pages = ""
        folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
        for style, name in FONTS.items():
            self.add_font(FAMILY, style, folder / name)
        regular = self.fonts[FAMILY.lower()]
        assert isinstance(regular, TTFFont)
        self.characters = frozenset(regular.cmap)
        self.set_margin(MARGIN)
        self.set_auto_page_break(auto=True, margin=MARGIN)
        self.set_title(self.plain(title))
        self.set_creator("rbstab")
        self.anchors = frozenset(anchors)

    def plain(self, text: str) -> str:
        """Put a text on one line, and replace characters that the font does not have."""
        spaced = " ".join(text.split())
        return "".join(char if ord(char) in self.characters else REPLACEMENT for char in spaced)

    def footer(self) -> None:
        """Write the page number; fpdf2 calls this on each page."""
        self.set_y(8 - MARGIN)
        self.set_font(FAMILY, size=SMALL)
        self.set_text_color(*GREY)
        self.cell(0, 5, str(self.page_no()), align="C")

    def ensure_orientation(self, *, landscape: bool = False) -> None:
        """Add a page if the current page has the other orientation."""
        if (self.cur_orientation is PageOrientation.LANDSCAPE) != landscape:
            self.add_page(orientation="L" if landscape else "P")

    def paragraph(
        self,
        text: str,
        *,
        style: str = "",
        size: float = TEXT,
        colour: tuple[int, int, int] = BLACK,
    ) -> None:
        """Write a paragraph, with a small space below it."""
        self.set_font(FAMILY, style, size)
        self.set_text_color(*colour)
        self.multi_cell(
            0, LEADING * size, self.plain(text), align="L", new_x=XPos.LMARGIN, new_y=YPos.NEXT
        )
        self.ln(0.25 * size)

    def heading(
        self, text: str, *, anchor: str = "", height: float = 30.0, landscape: bool = False
    ) -> None:
        """Write a heading, and add it to the outline.

        Args:
            text: The heading.
            anchor: The name that links use.
            height: The height of the block below it, which must be on the same page, mm.
            landscape: Whether that block needs a landscape page.
        """
        self.ensure_orientation(landscape=landscape)
        self.ln(3)
        if self.will_page_break(height + HEADING):
            self.add_page(same=True)
        if anchor in self.anchors:
            self.add_link(y=self.get_y(), name=anchor)
        self.start_section(self.plain(text))
        self.paragraph(text, style="B", size=HEADING)

    def height_of(self, picture: Picture) -> float:
        """Return the height of a picture with its caption, mm; at most the height of a page."""
        image, width, *_ = picture
        return min(
            width * image.height / image.width + self.caption_height(picture.caption),
            self.eph - HEADING,
        )

    @property
    def room(self) -> float:
        """The height that is left on the page, mm."""
        return float(self.h - self.b_margin - self.get_y())

    @property
    def is_at_top(self) -> bool:
        """Whether nothing is on the page yet."""
        return self.get_y() <= self.t_margin

    def add_picture(self, picture: Picture) -> None:
        """Add a picture with its caption; scale it down if it is too high for a page."""
        self.ensure_orientation()
        image, width, caption, alt_text = picture
        total_height = self.height_of(picture)
        height = total_height - self.caption_height(caption)
        width = min(width, height * image.width / image.height)
        if self.will_page_break(total_height):
            self.add_page()
        x = self.l_margin + (self.epw - width) / 2
        self.image(image, x=x, w=width, h=height, alt_text=self.plain(alt_text))
        self.ln(1)
        self.paragraph(caption, size=SMALL)
        self.ln(2)

    def caption_height(self, caption: str) -> float:
        """Return the height of a caption, with the space around it, mm."""
        return self._height_of_text(caption, "", SMALL) + 5

    def heading_height(self, text: str) -> float:
        """Return the height of a heading, with the space around it, mm."""
        return self._height_of_text(text, "B", HEADING) + 3 + 0.25 * HEADING

    def text_height(self, text: str, style: str = "", size: float = TEXT) -> float:
        """Return the height of a paragraph, with the space below it, mm."""
        return self._height_of_text(text, style, size) + 0.25 * size

    def _height_of_text(self, text: str, style: str, size: float) -> float:
        self.set_font(FAMILY, style, size)
        height = self.multi_cell(
            0, LEADING * size, self.plain(text), dry_run=True, output=MethodReturnValue.HEIGHT
        )
        assert isinstance(height, float)
        return height

    def to_bytes(self) -> bytes:
        """Return the finished file."""
        return bytes(self.output())

    def close_fonts(self) -> None:
        """Close the font files, which otherwise stay open until they are garbage collected."""
        for font in self.fonts.values():
            if isinstance(font, TTFFont):
                font.ttfont.close()
