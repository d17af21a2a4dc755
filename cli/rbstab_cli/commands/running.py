"""The commands that integrate: `rbstab run` and `rbstab sweep`."""

import click

from rbstab_cli.options import (
    FOLDER,
    PATH,
    declare,
    engine,
    flag,
    quiet,
    repeatable,
    results_folder,
    takes,
)


@declare(
    "run", "rbstab run experiment.yaml --set body.mass=50", "run:run", needs={"--to-end": "--prove"}
)
@takes("configs")
@results_folder("CONFIG.yaml gives DIR/CONFIG.h5")
@repeatable(
    "--member",
    "members",
    metavar="N",
    type=click.IntRange(0),
    help="Run member N of a plan, counted from 0; each CONFIG is then a plan. Repeatable.",
)
@takes("set")
@engine("from each config")
@flag("--force", help="Rerun finished runs; move a different result of the same name aside.")
@click.option(
    "--prove/--no-prove",
    default=None,
    help="Default: prove what can be proved after each run, in about ten seconds. --prove: try "
    "much longer. --no-prove: use only a proof that is stored in DIR/proofs.",
)
@flag("--to-end", help="With --prove: enclose the exact motion to the end of the run.")
@takes("allow_python", "json")
@quiet("Print no progress, no hints and no warnings of results; problems are still printed.")
def run() -> None:
    """Integrate configs and store their results.

    Each CONFIG is a YAML file (see `rbstab init`). Each result is stored as soon as it is computed.
    Then the program tries to prove where the motions end, and prints the answers: whether the
    motion from this start comes to rest, and whether all motions that stay in the range come to
    rest in one state.

    If a config has an error, nothing is run. A finished run is not run again; its stored result is
    used. A different result of the same name is never overwritten. A run that ends early is stored
    with its status, and the next one starts.

    With --member N each CONFIG is the plan of a sweep, for example DIR/PLAN/plan.yaml. Its member N
    is integrated as a single run and stored as DIR/PLAN-memberN.h5.
    """


@declare(
    "sweep",
    "rbstab sweep sweep.yaml",
    "sweeps.sweep:sweep",
    excludes={"--part": ("--force", "--compare"), "--dask": ("--threads", "--dry-run")},
    alone={"--status": ("--json", "-q")},
)
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
    help="Number of members that scipy computes again, for comparison; default: 4.",
)
@click.option(
    "--prove/--no-prove",
    default=None,
    help="Default: try for ten seconds to prove the rest states of each distinct body after the "
    "sweep, and count the members that are proved to converge. --prove: without a limit of time. "
    "--no-prove: prove nothing.",
)
@flag("--force", help="Move a different sweep of the same name aside.")
@takes("allow_python", "json", "quiet")
def sweep() -> None:
    """Run all members of a plan and store their outcomes.

    PLAN is a YAML file (see docs/sweeps.md). Run the same command again to resume a stopped sweep.
    A member that ends early is stored with its status. If no member completes, the exit code is 3.
    """
