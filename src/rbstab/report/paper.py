"""The pages of a PDF: type, headings with an outline, paragraphs, pictures with their captions."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from fpdf import FPDF
from fpdf.enums import MethodReturnValue, PageOrientation, XPos, YPos
from fpdf.fonts import TTFFont
from PIL import Image

FAMILY = "DejaVu Sans"

FONTS = {"": "DejaVuSans.ttf", "B": "DejaVuSans-Bold.ttf", "I": "DejaVuSans-Oblique.ttf"}
"""By style; matplotlib brings them, with the Greek and the signs of the paper."""

MARGIN = 20.0
"""mm."""

TEXT, SMALL, HEADING = 9.5, 8.0, 13.0
"""Sizes of type, points."""

BLACK, GREY = (0, 0, 0), (95, 95, 95)

LEADING = 0.5
"""mm from line to line for each point of the type."""

MISSING = "\N{REPLACEMENT CHARACTER}"
"""In place of a letter that the type does not have."""


class Paper(FPDF):
    """The pages of a report.

    Args:
        title: Of the report.
        anchors: The names of the places to which links may lead.
    """

    def __init__(self, title: str, anchors: Sequence[str] = ()) -> None:
        super().__init__(format="A4")
        # Otherwise a text of the report that happens to hold this sign would be changed.
        self.str_alias_nb_pages = ""
        folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
        for style, name in FONTS.items():
            self.add_font(FAMILY, style, folder / name)
        regular = self.fonts[FAMILY.lower()]
        assert isinstance(regular, TTFFont)
        self.letters = frozenset(regular.cmap)
        self.set_margin(MARGIN)
        self.set_auto_page_break(auto=True, margin=MARGIN)
        self.set_title(self.plain(title))
        self.set_creator("rbstab")
        self.anchors = frozenset(anchors)

    def plain(self, text: str) -> str:
        """A text in one line, of letters that the type has."""
        spaced = " ".join(text.split())
        return "".join(letter if ord(letter) in self.letters else MISSING for letter in spaced)

    def footer(self) -> None:
        """The number of the page."""
        self.set_y(8 - MARGIN)
        self.set_font(FAMILY, size=SMALL)
        self.set_text_color(*GREY)
        self.cell(0, 5, str(self.page_no()), align="C")

    def turn(self, *, lying: bool = False) -> None:
        """Sees to it that what follows stands on an upright page, or on one that lies."""
        if (self.cur_orientation is PageOrientation.LANDSCAPE) != lying:
            self.add_page(orientation="L" if lying else "P")

    def paragraph(
        self,
        text: str,
        *,
        style: str = "",
        size: float = TEXT,
        colour: tuple[int, int, int] = BLACK,
    ) -> None:
        """Writes a text, with a little space below it."""
        self.set_font(FAMILY, style, size)
        self.set_text_color(*colour)
        self.multi_cell(
            0, LEADING * size, self.plain(text), align="L", new_x=XPos.LMARGIN, new_y=YPos.NEXT
        )
        self.ln(0.25 * size)

    def heading(self, text: str, *, anchor: str = "") -> None:
        """Writes a heading; it stands in the outline too, and never alone at the foot of a page."""
        self.turn()
        self.ln(3)
        if self.will_page_break(45):
            self.add_page()
        if anchor in self.anchors:
            self.add_link(y=self.get_y(), name=anchor)
        self.start_section(self.plain(text))
        self.paragraph(text, style="B", size=HEADING)

    def picture(
        self, image: Image.Image, width: float, height: float, caption: str, said: str
    ) -> None:
        """Places a picture with its caption below, both on one page.

        Args:
            image: The picture.
            width: mm.
            height: mm; what does not fit on a page is made smaller.
            caption: What stands below.
            said: What is read to those who do not see it.
        """
        self.turn()
        self.set_font(FAMILY, size=SMALL)
        told = self.multi_cell(
            0, LEADING * SMALL, self.plain(caption), dry_run=True, output=MethodReturnValue.HEIGHT
        )
        assert isinstance(told, float)
        below = told + 5
        share = min(1.0, (self.eph - below) / height)
        if self.will_page_break(share * height + below):
            self.add_page()
        x = self.l_margin + (self.epw - share * width) / 2
        self.image(image, x=x, w=share * width, h=share * height, alt_text=self.plain(said))
        self.ln(1)
        self.paragraph(caption, size=SMALL)
        self.ln(2)

    def whole(self) -> bytes:
        """The finished file; nothing can be added to it any more."""
        content = bytes(self.output())
        for font in self.fonts.values():
            if isinstance(font, TTFFont):
                # Otherwise its file stays open until the collector of garbage comes by.
                font.ttfont.close()
        return content
