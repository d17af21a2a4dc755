"""Report sections on a sweep."""

from typing import NamedTuple

from rbstab.report.model.document import Block, Section
from rbstab.report.model.figure import Cells, Figure
from rbstab.report.model.words import untrusted
from rbstab.report.reading.sources import SweepFile
from rbstab.report.sweeps.answers import SweepAnswer, answer_of, cards_of
from rbstab.report.sweeps.basins import basin_blocks
from rbstab.report.sweeps.commands import member_command, proof_command
from rbstab.report.sweeps.conditions.comparison import comparison_blocks
from rbstab.report.sweeps.distributions import distribution_blocks
from rbstab.report.sweeps.fractions import fraction_blocks
from rbstab.report.sweeps.maps.figures import FIRST
from rbstab.report.sweeps.maps.maps import map_blocks
from rbstab.report.sweeps.members import Members, read_members
from rbstab.report.sweeps.notable import notable_blocks
from rbstab.report.sweeps.overview import overview_table, varied_table
from rbstab.report.sweeps.proofs import proof_blocks

UNREADABLE = (
    "This version of rbstab cannot read the plan of the sweep. The report has no maps, no "
    "comparison and no list of notable members."
)


class SweepPart(NamedTuple):
    """What a report says about a sweep: its title, the answer, and its sections.

    The title is that of the plan; "" if it has none.
    """

    title: str
    answer: SweepAnswer
    sections: tuple[Section, ...]


def sweep_part(sweep: SweepFile, *, alone: bool) -> SweepPart:
    """Return the answer and the sections on a sweep: outcomes first, the plan last.

    Args:
        sweep: The sweep; its file is read now.
        alone: Whether the report is about this sweep only. Its card then stands in its first
            section, and no heading repeats its name. Otherwise the card is to stand with others.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    members = read_members(sweep.path)
    name = sweep.name
    command = proof_command(sweep.path, members.plan)
    answer = answer_of(name, sweep.label, members, command)
    named = answer.card._replace(title=f"Sweep {sweep.label}")
    card = [cards_of(f"{name}-answer", [named])] if alone else []
    blocks = map_blocks(name, members, member_command(sweep.path))
    first = [block for block in blocks if _is_first(block, name)]
    over_parameters = [block for block in blocks if block not in first]
    answers: list[Block] = [*answer.sentences, *first, *card]
    answers += _outcomes(sweep, members, command)
    title = untrusted(members.table.attributes.get("title", ""))
    parts: list[tuple[str, str, list[Block]]] = [
        ("", "summary" if alone else title, answers),
        ("comparison", "comparison", comparison_blocks(name, members)),
        ("maps", _title_over_parameters(over_parameters), over_parameters),
        ("distributions", "distributions", distribution_blocks(name, members)),
        ("members", "notable members", notable_blocks(name, members, sweep.path)),
        ("plan", "plan and provenance", _facts(sweep, members)),
    ]
    sections = tuple(
        Section(
            f"{name}-{part}".removesuffix("-"),
            heading.capitalize() if alone else f"{sweep.label}: {heading}",
            tuple(blocks),
            folded=part == "plan",
        )
        for part, heading, blocks in parts
        if blocks
    )
    return SweepPart(title, answer, sections)


def _is_first(block: Block, name: str) -> bool:
    """Return whether a block shows what became of the members: it stands beside the answer."""
    names = {f"{name}-first", *(f"{name}-map-{key}" for key in FIRST)}
    return isinstance(block, Figure) and block.name in names


def _title_over_parameters(blocks: list[Block]) -> str:
    """Return the title of the section on what depends on parameters: it may have no map."""
    figures = [block for block in blocks if isinstance(block, Figure)]
    marks = (mark for figure in figures for panel in figure.panels for mark in panel.marks)
    return "maps" if any(isinstance(mark, Cells) for mark in marks) else "effects of the parameters"


def _outcomes(sweep: SweepFile, members: Members, command: str) -> list[Block]:
    return [
        *([UNREADABLE] if members.plan is None else []),
        *proof_blocks(sweep.name, members, command),
        *fraction_blocks(sweep.name, members),
        *basin_blocks(sweep.name, members),
    ]


def _facts(sweep: SweepFile, members: Members) -> list[Block]:
    varied = [] if members.plan is None else [varied_table(sweep.name, members.plan)]
    return [overview_table(sweep.name, members, sweep.path), *varied]
