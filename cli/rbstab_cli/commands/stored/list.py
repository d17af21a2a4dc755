"""`rbstab list`."""

from typing import Any

import click

from rbstab_cli.options import PATH, declare, takes


@declare("list", "rbstab list results")
@click.argument("folder", default="results", metavar="[DIR]", type=PATH)
@takes("json")
def command(**given: Any) -> int:
    """List the runs and sweeps in a folder of results, the newest first.

    DIR is results by default. For each run: its status, what its checks found, how sure it is that
    this start comes to rest, and that the whole range does, and its age. For each sweep: how many
    members completed, and how many are proved to come to rest. Proofs that were stored later count
    too. A file that cannot be read is listed with the reason; the exit code is then 4.
    """
    from rbstab_cli.work.stored.list import list_results

    return list_results(**given)
