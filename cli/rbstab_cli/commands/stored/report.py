"""`rbstab report`."""

from typing import Any

import click

from rbstab_cli.options import PATH, Choice, declare, flag, output, takes


@declare("report", "rbstab report results/experiment.h5 results/sweep -o report.html")
@takes("results")
@output(
    "File of the report; default results/report.html (.md, .pdf by format). With --format text the "
    "default is to print it.",
    PATH,
)
@click.option(
    "--format",
    "form",
    type=Choice(["html", "md", "pdf", "text"]),
    help="Format of the report; default: from the ending of FILE, or html without -o.",
)
@click.option("--title", help="Heading of the report; default: from the results.")
@flag("--force", help="Replace FILE even if it is not a report.")
@flag("--open", "opened", help="Open the report in the browser.")
@flag("--json", "as_json", help="Print the content as JSON; a report only with -o.")
@flag("-q", "--quiet", help="Do not print the path of the report; problems are still printed.")
def command(**given: Any) -> int:
    """Make a report of runs and sweeps.

    Each RESULT is the file of a run, the folder of a sweep, or a folder of results, by default
    results: then the runs and sweeps in it are taken, in the order of their names. Proofs, reports,
    figures and notes beside them are left out, so results/* may be named. If a result cannot be
    read, the report gives the reason and shows the others; the exit code is then 4.

    The formats md and pdf need the packages of `pip install "rbstab[report]"`.
    """
    from rbstab_cli.work.stored.report import report

    return report(**given)
