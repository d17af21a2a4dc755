"""The commands that change gains: derivatives, tuning, guards."""

import click

from rbstab.experiment.tuning.objective import OBJECTIVES
from rbstab_cli.options import FILE, PATH, Choice, declare, output, repeatable, takes


@declare("sensitivities", "rbstab sensitivities experiment.yaml", "sensitivities:sensitivities")
@takes("config", "set", "allow_python", "json")
@output("Also write the JSON to FILE.")
@takes("force", "quiet")
def sensitivities() -> None:
    """Compute how a run depends on its gains, its body and its initial state.

    Prints derivatives of the settling time (after which v stays below v(0)/1000) and of the peak of
    E by axis (the value farthest from zero), with respect to every gain, the mass, the inertia, the
    contact point and the initial state; the most important come first. One table is relative, in %
    for 1 %; the other is per unit of the parameter. --json adds the times of the peaks and the
    final state.

    The derivatives come from variational equations, also through switches and impacts. They need
    heyoka. A motion without derivatives, such as a chaotic one, is refused with the reason.
    """


@declare(
    "tune",
    "rbstab tune experiment.yaml --objective settling_time --over controller.L_c",
    "tune:tune",
)
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
def tune() -> None:
    """Scale gains to minimize an objective of the run.

    Writes the best config found; if none is better than the given one, writes nothing. Samples
    configs within the bounds, then descends along gradients from the given config and from the best
    sample. A run that ends early or does not settle counts as worst; if all do, the exit code is 3.
    Needs heyoka.
    """


@declare(
    "fit", "rbstab fit experiment.yaml motion.csv --free controller.K_r,controller.L_r", "fit:fit"
)
@takes("config")
@click.argument("data", metavar="DATA", type=PATH)
@repeatable(
    "--free",
    "frees",
    required=True,
    metavar="KEY,...",
    help="Numbers to fit: all of controller.K_r, or the entry controller.K_r[0]; also those of "
    "body, initial and elements. Repeatable.",
)
@output("File of the new config; CONFIG.yaml gives CONFIG_fitted.yaml in the working folder.")
@click.option(
    "--figure",
    metavar="FILE",
    type=FILE,
    help="Also draw the measured motion, the fitted one and the residuals: .svg, .pdf, .png; .csv.",
)
@takes("set", "allow_python", "force", "json", "quiet")
def fit() -> None:
    """Fit gains, or other numbers, to a measured motion.

    DATA is a CSV file. Its first row names the columns with their units, such as
    `time [s],theta1 [deg],x3 [mm]`: Euler angles theta1 to theta3, body rates omega1 to omega3,
    the centre of gravity x1 to x3, and the contact displacement e1 to e3. An
    empty cell is a gap.

    The squares of the residuals become least, from the values of the config; each column is
    weighed by its own scatter. Prints the fitted numbers with 95 % intervals, and writes the
    config with them. Warns of numbers, or combinations of them, that the data do not determine,
    and of residuals that are not random. If no minimum is found, no config is written, and the
    exit code is 3. Derivatives are exact, and need heyoka, also for a config with another engine.
    """


@declare("guard", "rbstab guard experiment.yaml -o guarded.yaml", "guard:guard")
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
def guard() -> None:
    """Find a guard with which motions are proved to keep θ2 between -90° and 90°.

    Shows what the guard changes in the run, and writes the config with it. If none is found, or its
    couple exceeds the limit, nothing is written, and the exit code is 3.

    A barrier adds the energy ½ k tan² θ2. Stiffnesses k from 0.01 to 50,000 N m are tried until
    every start is proved to converge and the run of the config stays in the range. Then some
    smaller ones are tried.

    A soft guard adds ½ k (|θ2| - θ_s)² (stiff) or K (|θ2| - θ_s) (repelling) beyond a soft angle
    θ_s. Finds the least k or K, to three digits, with which this start is proved to keep the range.
    """
