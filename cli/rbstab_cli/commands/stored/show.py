"""`rbstab show`."""

from typing import Any

import click

from rbstab_cli.options import PATH, declare, flag


@declare("show", "rbstab show results/experiment.h5")
@click.argument("path", metavar="RESULT", type=PATH)
@flag("--json", "as_json", help="Print everything as JSON, except the values of the arrays.")
@flag(
    "--config",
    "as_config",
    help="Print only the stored config, which can be run as it is.",
)
def command(**given: Any) -> int | None:
    """Show the content of a result.

    Prints first what is known about stability: of this start, and of every start. Then follow the
    status of the run, its Lyapunov function and audit, its final state, the checks of its
    certificate, the values that its reference prints beside the computed ones, the arrays in the
    file, and its provenance.

    A proof that was stored in the folder of the result after the run counts too.

    RESULT may also be the folder of a sweep, a proof, a folder of proofs, or a folder of results.
    Of a sweep it prints first how many members are proved, or seen, to come to rest.
    """
    from rbstab_cli.work.stored.show import show

    return show(**given)
