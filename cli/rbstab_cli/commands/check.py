"""`rbstab check`."""

from typing import Any

import click

from rbstab_cli.options import PATH, declare, repeatable, takes


@declare("check", "rbstab check experiment.yaml sweep.yaml")
@click.argument("configs", nargs=-1, metavar="[CONFIG]...", type=PATH)
@repeatable(
    "--element",
    "elements",
    metavar="FILE",
    type=PATH,
    help="Run the Python file FILE, and test each of its element classes at random states. "
    "Repeatable.",
)
@takes("set", "allow_python")
def command(**given: Any) -> int:
    """Check configs and plans and list their errors, or test elements of your own.

    If every CONFIG is valid, prints one line for each: variant, coordinates, engine and run id; of
    the plan of a sweep its members, variants and id. Otherwise prints all errors as
    FILE:LINE:COLUMN: KEY: PROBLEM (EXPECTED); the exit code is 2.

    With --element, says of each statement of each class whether it holds: its kinds of number, its
    power balance, its dissipation (see docs/own_elements.md). If one does not, the exit code is 2.
    """
    from rbstab_cli.work.check import check

    return check(**given)
