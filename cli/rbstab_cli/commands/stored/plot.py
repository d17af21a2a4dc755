"""`rbstab plot`."""

from typing import Any

import click

from rbstab_cli.options import PATH, declare, flag, output, takes


@declare("plot", "rbstab plot results/experiment.h5 --figure run-1-energy -o energy.pdf")
@takes("results")
@click.option("--figure", "name", metavar="NAME", help="The figure; without it they are listed.")
@output("File of the figure: .svg, .pdf or .png, 170 mm wide; .csv has its data.", PATH)
@flag(
    "--column",
    help="Draw it 80 mm wide, for one column of a paper: its panels are below each other.",
)
@takes("force")
def command(**given: Any) -> None:
    """Draw one figure of runs and sweeps, or write its data.

    The figures are those of `rbstab report` on the same results, by default those in the folder
    results. Without --figure their names and titles are listed. The drawing has no title: that is
    left to the caption of the paper.
    """
    from rbstab_cli.work.stored.plot import plot

    plot(**given)
