"""`rbstab run`."""

from typing import Any

import click

from rbstab.processes.imports import keep_imports
from rbstab_cli.options import declare, engine, flag, repeatable, results_folder, takes


@declare("run", "rbstab run experiment.yaml --set body.mass=50")
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
    help="Prove what can be proved after each run, in about ten seconds. --prove: try much longer. "
    "--no-prove: only a proof in DIR/proofs is used.",
)
@flag("--to-end", help="With --prove: enclose the exact motion to the end of the run.")
@takes("allow_python", "json")
@flag(
    "-q",
    "--quiet",
    help="Print no progress, no hints and no warnings of results; problems are still printed.",
)
def command(**given: Any) -> int:
    """Integrate configs and store their results.

    Each CONFIG is a YAML file (see `rbstab schema`). If one of them has an error, nothing is run. A
    finished run is not run again; its stored result is used. A different result of the same name is
    never overwritten. A run that does not complete is stored with its status, and the next one
    starts.

    The results are stored as soon as they are computed. Then the program proves what it can about
    each motion within some seconds, stores that too, and ends with the answers: whether the motion
    from this start comes to rest, and whether all motions that stay in the range end in one rest
    state.

    With --member N each CONFIG is the plan of a sweep. Its member N is integrated as a single run
    and stored as DIR/PLAN-memberN.h5. The plan may be the copy in the sweep's folder:
    DIR/PLAN/plan.yaml.
    """
    with keep_imports():
        from rbstab_cli.work.run import run

    return run(**given)
