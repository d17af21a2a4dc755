"""A report as PDF: Typst lays out the pages from the report as data and the figures as files."""

import json
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rbstab.report.model.document import MARKS, Animation, Cards, Report, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.figure_files import figure_bytes, figures_of
from rbstab.report.writers.sketches import svg


def pdf_of(report: Report) -> bytes:
    """Render a report as PDF; animations are only named."""
    # Imported late: a plain install lacks it.
    import typst

    with TemporaryDirectory() as name:
        folder = Path(name)
        for number, figure in enumerate(figures_of(report).values()):
            (folder / f"{number}.pdf").write_bytes(figure_bytes(figure, "pdf"))
        data = _Numbered(folder).report(report)
        text = json.dumps(data, ensure_ascii=False).encode("utf-8", "replace")
        (folder / "report.json").write_bytes(text)
        template = resources.files("rbstab.report.writers") / "templates" / "report.typ"
        (folder / "report.typ").write_bytes(template.read_bytes())
        return bytes(typst.compile(folder / "report.typ", root=folder))


class _Numbered:
    """Converts a report to plain data in which figures and sketches are names of files."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._figures = 0
        self._sketches = 0

    def report(self, report: Report) -> dict[str, Any]:
        sections = [
            {"title": section.title, "blocks": [self._block(block) for block in section.blocks]}
            for section in report.sections
        ]
        if report.unread:
            texts = [f"{path}: {reason}" for path, reason in report.unread]
            blocks = [{"kind": "text", "text": text} for text in texts]
            sections.append({"title": "Results that could not be read", "blocks": blocks})
        made = f"Made {report.made} by {report.command}"
        return {"title": report.title, "made": made, "sections": sections, "marks": MARKS}

    def _block(self, block: Any) -> dict[str, Any]:
        if isinstance(block, Table):
            heads = [{"text": head.text, "numbers": head.numbers} for head in block.heads]
            rows = [[{"text": cell.text, "tone": cell.tone} for cell in row] for row in block.rows]
            return {
                "kind": "table",
                "title": block.title,
                "heads": heads,
                "rows": rows,
                "note": block.note,
            }
        if isinstance(block, Figure):
            name = f"{self._figures}.pdf"
            self._figures += 1
            caption = f"{block.title}. {block.caption}".strip()
            return {"kind": "figure", "file": name, "caption": caption}
        if isinstance(block, Animation):
            text = f"{block.title}: the HTML report has the animation."
            return {"kind": "text", "text": text}
        if isinstance(block, Cards):
            return {
                "kind": "cards",
                "cards": [self._card(card) for card in block.cards],
                "note": block.note,
            }
        return {"kind": "text", "text": block}

    def _card(self, card: Any) -> dict[str, Any]:
        data = {
            "title": card.title,
            "alarm": card.marked_alarm,
            "statements": [statement._asdict() for statement in card.statements],
            "facts": [f"{name}: {value}" for name, value in card.facts],
            "sketch": "",
        }
        if card.sketch is not None:
            data["sketch"] = f"sketch{self._sketches}.svg"
            self._sketches += 1
            (self._folder / str(data["sketch"])).write_text(svg(card.sketch), encoding="utf-8")
            data["caption"] = card.sketch.words
        return data
