"""`rbstab guard`."""

from typing import Any

import click

from rbstab_cli.options import Choice, declare, output, takes


@declare("guard", "rbstab guard experiment.yaml -o guarded.yaml")
@takes("config")
@click.option(
    "--method",
    type=Choice(["barrier", "stiff", "repelling"]),
    default="barrier",
    show_default=True,
    help="barrier: for every start. stiff, repelling: a force beyond a soft angle, for this start.",
)
@click.option(
    "--soft-angle",
    metavar="RAD",
    type=float,
    help="|θ2| from which a soft guard acts, rad.  [default: 1.2]",
)
@click.option(
    "--limit",
    metavar="N_M",
    type=float,
    help="Largest couple, N m, that a soft guard may have in the run.",
)
@output("File of the new config; CONFIG.yaml gives CONFIG_guarded.yaml in the working folder.")
@takes("set", "allow_python", "force", "json", "quiet")
def command(**given: Any) -> int:
    """Find a guard of θ2 with which motions are proved to keep the range.

    A barrier adds the energy ½ k tan² θ2. Stiffnesses k from 0.01 to 50,000 N m are tried until
    every start is proved to converge and the run of the config stays in the range. Then some
    smaller ones are tried.

    A soft guard adds ½ k (|θ2| - θ_s)² (stiff) or K (|θ2| - θ_s) (repelling) beyond a soft angle.
    The least k or K, of three digits, is found with which this start is proved to keep the range.

    Shows what the guard changes in the run, and writes the config with it; such a guard in the
    given config is replaced. If none is found, or its couple exceeds the limit, nothing is written,
    and the exit code is 3.
    """
    from rbstab_cli.work.guard import guard

    return guard(**given)
