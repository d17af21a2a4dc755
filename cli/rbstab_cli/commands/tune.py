"""`rbstab tune`."""

from typing import Any

import click

from rbstab.experiment.tuning.objective import OBJECTIVES
from rbstab_cli.options import Choice, declare, output, repeatable, takes


@declare("tune", "rbstab tune experiment.yaml --objective settling_time --over controller.L_c")
@takes("config")
@click.option(
    "--objective",
    required=True,
    type=Choice(list(OBJECTIVES)),
    help="The quantity to minimize: "
    + "; ".join(f"{o.name}, {o.meaning} [{o.unit}]" for o in OBJECTIVES.values())
    + ".",
)
@repeatable(
    "--over",
    "overs",
    required=True,
    metavar="KEY,...",
    help="Gains to scale: all of controller.L_c, or the diagonal entry controller.L_c[0]. "
    "Repeatable.",
)
@click.option(
    "--bounds",
    default="0.1:10",
    show_default=True,
    metavar="LOW:HIGH",
    help="The smallest and the largest factor on the given gains.",
)
@output("File of the new config; CONFIG.yaml gives CONFIG_tuned.yaml in the working folder.")
@takes("set", "allow_python", "force", "json", "quiet")
def command(**given: Any) -> int:
    """Scale gains to minimize an objective of the run.

    Samples configs within the bounds, then descends along exact gradients from the given config and
    from the best sample. Writes the best config found; if none is better than the given one, writes
    nothing. A run that does not complete or does not settle counts as worst; if no run completes
    and settles, the exit code is 3. Gradients need heyoka, also for a config with another engine.
    """
    from rbstab_cli.work.tune import tune

    return tune(**given)
