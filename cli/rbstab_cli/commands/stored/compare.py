"""`rbstab compare`."""

from typing import Any

import click

from rbstab_cli.options import PATH, declare, takes


@declare("compare", "rbstab compare results/a.h5 results/b.h5")
@click.argument("first", metavar="A", type=PATH)
@click.argument("second", metavar="B", type=PATH)
@takes("json")
def command(**given: Any) -> None:
    """Compare two results: what was run, and what came out.

    A and B are both files of runs, or both folders of sweeps. A folder with one result in it stands
    for this result. Prints the keys of their configs or plans that differ, and their outcomes
    beside each other. Proofs that were stored later count too.
    """
    from rbstab_cli.work.stored.compare import compare

    compare(**given)
