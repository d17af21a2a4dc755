"""The pages of a PDF: type, headings with an outline, paragraphs, pictures with their captions."""

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


class Picture(NamedTuple):
    """A picture: its width, mm, what stands below it, what is read out where it is not seen."""

    image: Image.Image
    width: float
    caption: str
    said: str


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

    def heading(
        self, text: str, *, anchor: str = "", room: float = 30.0, lying: bool = False
    ) -> None:
        """Writes a heading that stands in the outline too.

        Args:
            text: The heading.
            anchor: The name of this place.
            room: The height of what it has to share its page with, mm.
            lying: Whether that stands on a page that lies.
        """
        self.turn(lying=lying)
        self.ln(3)
        if self.will_page_break(room + HEADING):
            self.add_page(same=True)
        if anchor in self.anchors:
            self.add_link(y=self.get_y(), name=anchor)
        self.start_section(self.plain(text))
        self.paragraph(text, style="B", size=HEADING)

    def height_of(self, picture: Picture) -> float:
        """The height of a picture with its caption on a page of its own at most, mm."""
        image, width, *_ = picture
        return min(width * image.height / image.width + self._below(picture), self.eph - HEADING)

    def place(self, picture: Picture) -> None:
        """Places a picture with its caption; what is too tall for a page is made smaller."""
        self.turn()
        image, width, caption, said = picture
        room = self.height_of(picture)
        height = room - self._below(picture)
        width = min(width, height * image.width / image.height)
        if self.will_page_break(room):
            self.add_page()
        x = self.l_margin + (self.epw - width) / 2
        self.image(image, x=x, w=width, h=height, alt_text=self.plain(said))
        self.ln(1)
        self.paragraph(caption, size=SMALL)
        self.ln(2)

    def _below(self, picture: Picture) -> float:
        """What a caption takes, with the space around it, mm."""
        self.set_font(FAMILY, size=SMALL)
        text = self.plain(picture.caption)
        told = self.multi_cell(
            0, LEADING * SMALL, text, dry_run=True, output=MethodReturnValue.HEIGHT
        )
        assert isinstance(told, float)
        return told + 5

    def whole(self) -> bytes:
        """The finished file."""
        return bytes(self.output())

    def close_fonts(self) -> None:
        """Closes the files of the type, which otherwise stay open until memory is tidied up."""
        for font in self.fonts.values():
            if isinstance(font, TTFFont):
                font.ttfont.close()
