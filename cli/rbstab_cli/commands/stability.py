"""`rbstab stability`."""

from typing import Any

import click

from rbstab_cli.options import declare, flag, output, repeatable, results_folder, takes


@declare("stability", "rbstab stability experiment.yaml --within controller=±20%")
@takes("configs")
@flag("--search-only", help="Search for rest states without a proof.")
@repeatable(
    "--along",
    "alongs",
    metavar="KEY=FROM:TO:COUNT",
    help="Compute the eigenvalues for COUNT factors on a gain, geometrically spaced from FROM to "
    "TO: controller.K_r=0.01:1:41. Repeatable.",
)
@repeatable(
    "--within",
    "withins",
    metavar="KEY=±SIZE",
    help="Prove convergence for all bodies within tolerances (controller=±20%, "
    "body.contact_point=±0.01, gravity), or for all starts (initial.angular_velocity=±0.5). +- may "
    "stand for ±. Repeatable.",
)
@repeatable(
    "--largest-within",
    "largest",
    metavar="KEY",
    help="Find the largest percentage p for which KEY=±p% is proved, beside the tolerances of "
    "--within. Repeatable: each KEY by itself.",
)
@click.option(
    "--time-limit",
    metavar="SECONDS",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Wall time for the proof of --within, and for each --largest-within; what is proved by "
    "then is printed.  [default: 60, or 600 for tolerances of the initial state]",
)
@takes("set", "allow_python")
@results_folder("proofs are stored in DIR/proofs and read from there", "--results")
@flag("--no-run", help="Leave out the run and its certificate.")
@takes("json")
@output("Write the output to FILE instead of printing it.")
@takes("force", "quiet")
def command(**given: Any) -> None:
    """Find the rest states of configs, and prove where motions converge.

    For each CONFIG, prints: its rest states, stable and unstable, and whether the list is proved to
    be complete; whether every start, or almost every start, converges to a stable one; the region
    in which convergence is proved; whether the initial state is inside, and if not, when its exact
    motion enters; the linearised system at each rest state; the certificate of its run. A finished
    run is read from DIR; a new run is not stored.

    With --json, `search` says how the search for rest states ended, `proved` whether `states` are
    all of them, `stable_count` how many are stable. `every_start` is whether every start is proved
    to converge. `almost_every_start` has the same of almost every start: `proved`, `returns`
    (whether all of the rest states that are reached are near the desired orientation), their
    numbers `states`, and `why` it is not proved. Of a body whose energy depends on no Euler angles,
    `on_rotations` has the quaternions of all rest states on SO(3), and families of them.
    """
    from rbstab_cli.work.stability.stability import stability

    stability(**given)
