"""The commands that read stored results, and compute nothing."""

import click

from rbstab_cli.options import PATH, Choice, declare, flag, output, quiet, takes


@declare(
    "show",
    "rbstab show results/experiment.h5",
    "stored.show:show",
    excludes={"--json": ("--config",)},
)
@click.argument("path", metavar="RESULT", type=PATH)
@flag("--json", "as_json", help="Print everything as JSON, except the values of the arrays.")
@flag(
    "--config",
    "as_config",
    help="Print only the stored config, which can be run as it is.",
)
def show() -> None:
    """Show the content of a result.

    RESULT is the file of a run, the folder of a sweep, a proof, a folder of proofs, or a folder of
    results.

    For a run, prints first what is known about stability, for this start and for every start; also
    from proofs that were stored later. Then follow status, Lyapunov function, final state, checks,
    the paper's values beside the computed ones, arrays, and software versions. For a sweep, prints
    first how many members are proved, or seen, to come to rest.
    """


@declare("list", "rbstab list results", "stored.list:list_results")
@click.argument("folder", default="results", metavar="[DIR]", type=PATH)
@takes("json")
def list_() -> None:
    """List the runs and sweeps in a folder of results, the newest first.

    DIR is results by default. For each run: its outcome, how sure it is that this start comes to
    rest, and that the whole range does, and its age. For each sweep: how many members completed,
    and how many are proved to come to rest. A file that cannot be read is listed with the reason;
    the exit code is then 4.
    """


@declare("compare", "rbstab compare results/a.h5 results/b.h5", "stored.compare:compare")
@click.argument("first", metavar="A", type=PATH)
@click.argument("second", metavar="B", type=PATH)
@takes("json")
def compare() -> None:
    """Compare two results: what was run, and what came out.

    A and B are both files of runs, or both folders of sweeps. A folder with one result stands for
    this result. Prints the keys in which their configs or plans differ, and their outcomes beside
    each other.
    """


@declare("export", "rbstab export results/sweep -o sweep.csv", "stored.export:export")
@takes("results")
@output(
    "File of the table: .csv, .mat (MATLAB), .parquet, which needs pandas and pyarrow, or, of a "
    "sweep, .nc (netCDF-4); default results.csv.",
    PATH,
    default="results.csv",
)
@flag("--traces", help="Write the motions: one row for each sample.")
@takes("force")
def export() -> None:
    """Write runs, or a sweep, as a table for other programs.

    The table has one row for each run (what `rbstab show --json` prints, the settling time and the
    final state), or for each member of a sweep (the varied values and the outcomes). RESULT may be
    a folder of runs, by default results.

    Vectors are split into columns: position_0, position_1, position_2. Units are SI, angles
    radians. What is not known is nan. With --traces, the table has one row for each sample of all
    runs, or of the members whose traces are stored.
    """


@declare(
    "report",
    "rbstab report results/experiment.h5 results/sweep -o report.html",
    "stored.report:report",
)
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
@quiet("Do not print the path of the report; problems are still printed.")
def report() -> None:
    """Make a report of runs and sweeps.

    Each RESULT is the file of a run, the folder of a sweep, or a folder of results, by default
    results. Other files are left out, so results/* may be named. If a result cannot be read, the
    report gives the reason and shows the others; the exit code is then 4.

    The formats md and pdf need the packages of `pip install "rbstab[report]"`.
    """


@declare(
    "plot",
    "rbstab plot results/experiment.h5 --figure run-1-energy -o energy.pdf",
    "stored.plot:plot",
    needs={"--figure": "-o", "-o": "--figure", "--column": "-o"},
)
@takes("results")
@click.option("--figure", "name", metavar="NAME", help="The figure; without it they are listed.")
@output("File of the figure: .svg, .pdf or .png, 170 mm wide; .csv has its data.", PATH)
@flag(
    "--column",
    help="Draw it 80 mm wide, for one column of a paper.",
)
@takes("force")
def plot() -> None:
    """Draw one figure of runs and sweeps, or write its data.

    The figures are those of `rbstab report` on the same results, by default those in the folder
    results. Without --figure, lists their names and titles. The drawing has no title.
    """
