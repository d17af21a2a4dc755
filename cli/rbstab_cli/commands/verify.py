"""`rbstab verify`."""

from typing import Any

import click

from rbstab_cli.options import FILE, PATH, declare, flag, takes


@declare("verify", "rbstab verify results")
@click.argument("proofs", metavar="PROOF...", nargs=-1, required=True, type=PATH)
@click.option(
    "--config",
    "config_path",
    metavar="CONFIG",
    type=PATH,
    help="Also check that PROOF is the proof of this config.",
)
@takes("set")
@flag("--second", help="Also ask codac, a solver of others, about the equations of CONFIG.")
@click.option(
    "--certificate",
    metavar="FILE",
    type=FILE,
    help="Write all boxes by which PROOF was checked, with their reasons, to FILE as JSON.",
)
@takes("force", "allow_python", "json", "quiet")
def command(**given: Any) -> int:
    """Check proofs by a program of its own.

    Each PROOF is a file of DIR/proofs, as `rbstab stability` writes it, or a folder of results DIR.
    Of a folder all proofs of rest states are checked, or with --config the newest proof of that
    config.

    Of several proofs, those that are refused are printed in full, and of the others how many claims
    of each kind were checked. A file that only says why there is no proof claims nothing, and is
    not counted.

    The rest states of a proof and the region of each minimum are checked. The checker shares no
    bounds and no arithmetic with the program that made the proof: it computes all of them anew, in
    balls of 128 bits. If a claim is wrong or cannot be confirmed, the exit code is 4. If no claim
    is refused, but a check takes too long (more than 3,000,000 evaluations of the energy), it is 5.

    With --second, codac confirms or refutes rest states and certified regions from the equations of
    CONFIG, in five minutes at most. If it refutes a claim, the exit code is 4. If it leaves one
    open, it is 5.
    """
    from rbstab_cli.work.verify import verify

    return verify(**given)
