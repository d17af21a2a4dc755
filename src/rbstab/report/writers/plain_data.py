"""A report as plain data: sentences, tables, and the names of figures and animations."""

from typing import Any

from rbstab.report.model.document import Animation, Block, Cards, Cell, Report, Table
from rbstab.report.model.figure import Figure


def data_of(report: Report) -> dict[str, Any]:
    """Convert a report to plain data for JSON; its numbers may be infinite or NaN."""
    return {
        "title": report.title,
        "created": report.created,
        "command": report.command,
        "sections": [
            {
                "name": section.name,
                "title": section.title,
                "blocks": [_block(block) for block in section.blocks],
            }
            for section in report.sections
        ],
        "unread": [unread._asdict() for unread in report.unread],
    }


def _block(block: Block) -> dict[str, Any]:
    if isinstance(block, Table):
        heads = [{"label": head.label, "unit": head.unit} for head in block.heads]
        rows = [[_entry(cell) for cell in row] for row in block.rows]
        common = {"name": block.name, "title": block.title, "note": block.note}
        return {"kind": "table", **common, "columns": heads, "rows": rows}
    if isinstance(block, Figure):
        common = {"name": block.name, "title": block.title, "caption": block.caption}
        return {"kind": "figure", **common}
    if isinstance(block, Animation):
        return {"kind": "motion", "name": block.name, "title": block.title}
    if isinstance(block, Cards):
        cards = [
            {
                "title": card.title,
                "alarm": card.alarm,
                "statements": [statement._asdict() for statement in card.statements],
                "facts": dict(card.facts),
            }
            for card in block.cards
        ]
        return {"kind": "cards", "name": block.name, "cards": cards, "note": block.note}
    return {"kind": "text", "text": block}


def _entry(cell: Cell) -> str | float:
    return cell.text if cell.value is None else cell.value
