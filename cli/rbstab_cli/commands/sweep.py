"""`rbstab sweep`."""

from typing import Any

import click

from rbstab.processes.imports import keep_imports
from rbstab_cli.options import FOLDER, PATH, declare, engine, flag, results_folder, takes


class PartType(click.ParamType[Any]):
    """The type of --part: I/N."""

    name = "part"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the part.

        Raises:
            BadParameter: The text is no part.
        """
        from rbstab.sweep.folder.open_folder import parse_part

        try:
            return parse_part(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


@declare("sweep", "rbstab sweep sweep.yaml")
@click.argument("plan", required=False, metavar="PLAN", type=PATH)
@click.option(
    "--status",
    "status_of",
    metavar="DIR",
    type=FOLDER,
    help="Show the status of the sweep in the folder DIR, and run nothing.",
)
@results_folder("PLAN.yaml gives the folder DIR/PLAN")
@takes("set")
@engine("that of the stored sweep, or else heyoka if it is installed; not that of the base")
@click.option(
    "--threads",
    type=click.IntRange(1),
    help="Threads that integrate members; default: one for each processor.",
)
@click.option("--shard-size", type=click.IntRange(1), help="Members in each shard (file).")
@click.option(
    "--part",
    metavar="I/N",
    type=PartType(),
    help="Compute only part I of N. When all parts are done, run it without this option.",
)
@click.option(
    "--dask",
    metavar="ADDRESS",
    help="Compute on a Dask cluster. ADDRESS is its scheduler's address, or its JSON file.",
)
@flag("--dry-run", help="Count the members and the disk space, and run nothing.")
@flag(
    "--retry-failed",
    help="Rerun shards with failed members (diverged, hit a limit, not integrated).",
)
@flag("--fail-fast", help="Stop at the first failed member.")
@click.option(
    "--compare",
    metavar="N",
    type=click.IntRange(1),
    help="Members that scipy computes again, for comparison; default: 4.",
)
@click.option(
    "--prove/--no-prove",
    default=None,
    help="Prove the rest states of each distinct body after the sweep, for at most ten seconds, "
    "and count the members that are proved to converge. --prove: without a limit of time, and "
    "with more boxes for tied bodies with springs. --no-prove: nothing is proved.",
)
@flag("--force", help="Move a different sweep of the same name aside.")
@takes("allow_python", "json", "quiet")
@click.pass_context
def command(context: click.Context, /, **given: Any) -> int | None:
    """Run all members of a plan and store their outcomes.

    PLAN is a YAML file (see docs/sweeps.md). Run the same command again to resume a stopped sweep;
    finished shards are not computed again. A member that does not complete is stored with its
    status. If no member completes, the exit code is 3.
    """
    with keep_imports():
        from rbstab_cli.work.sweeps.sweep import sweep

    return sweep(context, **given)
