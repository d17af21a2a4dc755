"""What a report says of a sweep."""

from rbstab.report.model.document import Block, Section
from rbstab.report.model.words import untrusted
from rbstab.report.reading.sources import SweepFile
from rbstab.report.sweeps.comparison import comparison_blocks
from rbstab.report.sweeps.distributions import distribution_blocks
from rbstab.report.sweeps.fractions import fraction_blocks
from rbstab.report.sweeps.maps.maps import map_blocks
from rbstab.report.sweeps.members import Members, read_members
from rbstab.report.sweeps.notable import notable_blocks
from rbstab.report.sweeps.overview import overview_table, varied_table

UNREADABLE = (
    "Its plan cannot be read by this version of the program; so there are no maps of it, and no "
    "members are compared or listed."
)


def sweep_sections(sweep: SweepFile) -> tuple[Section, ...]:
    """The sections about a sweep: what it is, how its members ended, where, and how many.

    Args:
        sweep: The sweep; what is needed of it is read now.

    Raises:
        StoreError: It cannot be read, or is damaged.
    """
    members = read_members(sweep.path)
    name = sweep.name
    parts: list[tuple[str, str, list[Block]]] = [
        ("", untrusted(members.table.attributes.get("title", "")), _facts(sweep, members)),
        ("maps", "maps", map_blocks(name, members)),
        ("distributions", "distributions", distribution_blocks(name, members)),
        ("comparison", "side by side", comparison_blocks(name, members)),
        ("members", "members worth a look", notable_blocks(name, members, sweep.path)),
    ]
    return tuple(
        Section(f"{name}-{part}".removesuffix("-"), f"{sweep.label}: {title}", tuple(blocks))
        for part, title, blocks in parts
        if blocks
    )


def _facts(sweep: SweepFile, members: Members) -> list[Block]:
    blocks: list[Block] = [overview_table(sweep.name, members, sweep.path)]
    if members.plan is None:
        blocks.append(UNREADABLE)
    else:
        blocks.append(varied_table(sweep.name, members.plan))
    return blocks + fraction_blocks(sweep.name, members)
