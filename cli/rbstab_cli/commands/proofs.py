"""The commands that prove, and that check proofs."""

import click

from rbstab_cli.options import FILE, PATH, declare, flag, output, repeatable, results_folder, takes


@declare(
    "stability",
    "rbstab stability experiment.yaml --within controller=±20%",
    "stability.stability:stability",
    excludes={"--search-only": ("--within", "--largest-within", "--bound", "--largest")},
    needs={"--figure": "--along", "--bound": "--within-tilt", "--within-tilt": "--bound"},
)
@takes("configs")
@flag("--search-only", help="Search for rest states without a proof.")
@repeatable(
    "--along",
    "alongs",
    metavar="KEY=FROM:TO:COUNT",
    help="Compute eigenvalues and all rest states for COUNT values of a number from FROM to TO "
    "(controller.K_r[0]=1:20:41), or factors on a whole gain (controller.K_r=x0.1:x2:41), and "
    "prove on which intervals their number is the same. Repeatable.",
)
@click.option(
    "--figure",
    metavar="FILE",
    type=FILE,
    help="Draw the rest states of --along into FILE: .svg, .pdf, .png, or .csv for the data.",
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
    help="Wall time for the proof of --within, and for each --largest-within or --along; what is "
    "proved by then is printed.  [default: 60, or 600 for tolerances of the initial state]",
)
@repeatable(
    "--bound",
    "bounds",
    metavar="KIND=SIZE",
    help="Prove that any disturbance up to SIZE keeps the tilt below that of --within-tilt for "
    "ever: couple=100, N m; force=50, N, at the centre of gravity, or force=50@0.1,0,0.4 at a "
    "point of the body, m. Repeatable: a couple and a force together.  [default: bound of CONFIG]",
)
@click.option("--within-tilt", "tilt", metavar="RAD", help="The tilt of --bound, rad, below π/2.")
@flag(
    "--largest",
    "largest_bound",
    help="Find the largest disturbances that are proved, and the smallest that break the bound.",
)
@takes("set", "allow_python")
@results_folder("proofs are stored in DIR/proofs and read from there", "--results")
@flag("--no-run", help="Leave out the run and its certificate.")
@takes("json")
@output("Write the output to FILE instead of printing it.")
@takes("force", "quiet")
def stability() -> None:
    """Find the rest states of configs, and prove where motions converge.

    For each CONFIG, prints: its rest states, stable and unstable, and whether the list is proved to
    be complete; whether every start, or almost every start, converges to a stable one; the region
    in which convergence is proved; whether the initial state is inside, and if not, when its exact
    motion enters; the modes at the lowest rest state; the checks of its run. A finished run is
    read from DIR; a new run is not stored.

    With --json, `search` says how the search for rest states ended, `proved` whether `states` are
    all of them, `stable_count` how many are stable. `every_start`: whether every start is proved to
    converge. `almost_every_start`: whether that is `proved`, `returns` (whether all reached rest
    states are near the desired orientation), their numbers `states`, and `why` it is not proved. If
    the energy depends on no Euler angles, `on_rotations` has the quaternions of all rest states on
    SO(3), and families of them. `motors` has, for each motor with a limit or a
    lag, whether it is `passive`, and what is known if not.

    In `along`, `intervals` count rest states, and say whether that is proved for each value;
    `turns` are folds and pitchforks, computed; `branches` are curves of rest states, stable where
    `index` is 0.

    `bound` is what is proved of --bound, or of the section `bound` of CONFIG: `proved` and `why`
    not, `couple`, `force`, `tilt`, and the `level` below which V must start; with --largest,
    `largest` has what is `proved`, and what was `found_to_break` it.
    """


@declare(
    "verify",
    "rbstab verify results",
    "verify:verify",
    needs={"--set": "--config", "--allow-python": "--config", "--second": "--config"},
)
@click.argument("proofs", metavar="PROOF...", nargs=-1, required=True, type=PATH)
@click.option(
    "--config",
    "config_path",
    metavar="CONFIG",
    type=PATH,
    help="Also check that PROOF is the proof of this config.",
)
@takes("set")
@flag("--second", help="Also ask another solver, codac, about the equations of CONFIG.")
@click.option(
    "--certificate",
    metavar="FILE",
    type=FILE,
    help="Write the boxes of the check, each with the reason why it is settled, to FILE as JSON.",
)
@takes("force", "allow_python", "json", "quiet")
def verify() -> None:
    """Check proofs by a second program.

    Checks the rest states of each PROOF and the region of each minimum, or a bound on disturbances.
    The checker shares no bounds with the program that made the proof: it computes all of them anew,
    in intervals of 128 bits. If a claim is wrong or cannot be confirmed, the exit code is 4. If no
    claim is refused, but a check takes too long, it is 5.

    Each PROOF is a file of DIR/proofs, as `rbstab stability` writes it, or a folder of results DIR.
    Of a folder all these proofs are checked, or with --config the newest ones of that config.
    Of several proofs, only refused ones are printed in full.

    With --second, codac confirms or refutes rest states and certified regions from the equations of
    CONFIG, in five minutes at most. If it refutes a claim, the exit code is 4. If it leaves one
    open, it is 5.
    """
