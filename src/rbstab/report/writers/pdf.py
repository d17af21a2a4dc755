"""A report as PDF: Typst lays out the pages from the report as data and the figures as files."""

import json
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rbstab.report.model.document import MARKS, Block, Cards, Report, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.figure_files import figure_bytes
from rbstab.report.writers.plain_data import data_of
from rbstab.report.writers.sketches import svg


def pdf_of(report: Report) -> bytes:
    """Render a report as PDF; animations are only named."""
    # Imported late: a plain install lacks it.
    import typst

    with TemporaryDirectory() as name:
        folder = Path(name)
        data = data_of(report) | {"made": report.made, "marks": MARKS}
        for section, shown in zip(report.sections, data["sections"], strict=True):
            for block, block_data in zip(section.blocks, shown["blocks"], strict=True):
                _complete(block_data, block, folder)
        text = json.dumps(data, ensure_ascii=False).encode("utf-8", "replace")
        (folder / "report.json").write_bytes(text)
        template = resources.files("rbstab.report.writers") / "templates" / "report.typ"
        (folder / "report.typ").write_bytes(template.read_bytes())
        return bytes(typst.compile(folder / "report.typ", root=folder))


def _complete(data: dict[str, Any], block: Block, folder: Path) -> None:
    """Add to the data of a block what a page shows: texts with their tones, and pictures."""
    match block:
        case Table():
            data["heads"] = [{"text": head.text, "numbers": head.numbers} for head in block.heads]
            rows = [[{"text": cell.text, "tone": cell.tone} for cell in row] for row in block.rows]
            data["rows"] = rows
        case Figure():
            (folder / f"{block.name}.pdf").write_bytes(figure_bytes(block, "pdf"))
        case Cards():
            for number, (card, card_data) in enumerate(
                zip(block.cards, data["cards"], strict=True)
            ):
                card_data |= {
                    "sketch": "",
                    "facts": [f"{name}: {value}" for name, value in card.facts],
                }
                if card.sketch is not None:
                    card_data |= {
                        "sketch": f"{block.name}-{number}.svg",
                        "caption": card.sketch.words,
                    }
                    (folder / card_data["sketch"]).write_text(svg(card.sketch), encoding="utf-8")
