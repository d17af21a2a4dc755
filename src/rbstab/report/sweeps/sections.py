"""Report sections on a sweep."""

from typing import NamedTuple

from rbstab.report.model.document import Block, Section
from rbstab.report.model.words import untrusted
from rbstab.report.reading.sources import SweepFile
from rbstab.report.sweeps.answers import SYMBOLS, SweepAnswer, answer_of, commands_of
from rbstab.report.sweeps.basins import basin_blocks
from rbstab.report.sweeps.conditions.differences import difference_table
from rbstab.report.sweeps.conditions.paired_conditions import conditions_of
from rbstab.report.sweeps.disturbed import disturbed_blocks
from rbstab.report.sweeps.maps.maps import over_parameters
from rbstab.report.sweeps.members import read_members
from rbstab.report.sweeps.notable import notable_blocks
from rbstab.report.sweeps.outcomes import (
    outcome_bars,
    outcome_table,
    quantile_table,
    spread_figures,
)
from rbstab.report.sweeps.overview import overview_table
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

    At most four figures: two maps (or curves, or a map and effects), the distributions, and bars of
    the outcomes of conditions. The first one stands below the answer, after that of a stated bound.

    Args:
        sweep: The sweep; its file is read now.
        alone: Whether the report is about this sweep only, so that no heading repeats its name.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    members = read_members(sweep.path)
    name, plan, attributes = sweep.name, members.plan, members.table.attributes
    commands = commands_of(sweep.path, plan)
    answer = answer_of(name, sweep.label, members, commands)
    maps, effects = over_parameters(name, members, commands.member)
    compared = [*outcome_bars(name, members), *spread_figures(name, members)]
    # Drawn members of several conditions are there to be compared.
    is_comparison = members.is_drawn and conditions_of(members).parameters
    figures = [*compared, *maps] if is_comparison else [*maps, *compared]
    summary: list[Block] = [
        *answer.sentences,
        *disturbed_blocks(name, members.disturbed, commands.member),
        *figures[:1],
        *([] if plan is not None else [UNREADABLE]),
        outcome_table(name, members),
        *proof_blocks(name, members, commands.proof),
        *basin_blocks(name, members),
    ]
    facts: list[Block] = [
        overview_table(name, members, sweep.path),
        *([" ".join(f"{word}: {meaning}." for word, meaning in SYMBOLS)] if alone else []),
    ]
    details: list[Block] = [
        *figures[1:],
        *effects,
        quantile_table(name, members),
        *difference_table(name, members),
    ]
    title = untrusted(attributes.get("title", ""))
    parts: list[tuple[str, str, list[Block]]] = [
        ("", "summary" if alone else title, summary),
        ("details", "effects and distributions", details),
        ("members", "notable members", notable_blocks(name, members, commands.member)),
        ("plan", "plan and provenance", facts),
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
