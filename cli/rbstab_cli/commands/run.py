"""`rbstab run`."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from rbstab.processes.imports import keep_imports
from rbstab_cli import exit_codes
from rbstab_cli.arguments.choice import Choice
from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.engine import refuse_engine_change
from rbstab_cli.arguments.members import MEMBERS, load_members
from rbstab_cli.arguments.options import (
    ALLOW_PYTHON,
    AS_JSON,
    CHANGES,
    quiet_option,
    results_folder,
)
from rbstab_cli.arguments.outputs import (
    check_proofs_folder,
    check_results_folder,
    has_all_proofs,
)
from rbstab_cli.run_batch import MAX_NAMED, Batch, Finished

REPEATED = "the same command with --prove"
"""The command that makes a proof, as the answers of this command name it."""


@click.command("run")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=click.Path(path_type=Path)
)
@results_folder("CONFIG.yaml gives DIR/CONFIG.h5")
@MEMBERS
@CHANGES
@click.option(
    "--engine",
    type=Choice(["scipy", "heyoka"]),
    help="Integrator: scipy, or heyoka (compiled); default: from each config.",
)
@click.option(
    "--force",
    is_flag=True,
    help="Rerun finished runs; move a different result of the same name aside.",
)
@click.option(
    "--prove/--no-prove",
    default=None,
    help="After the runs, the rest states and their regions are proved, or read from DIR/proofs; "
    "then each exact motion is enclosed until convergence is proved, for at most 150 steps (some "
    "five seconds). The first proof ends after some five seconds too: after a number of boxes that "
    "is the same on each machine. --prove: at most 2000 steps, and many more boxes. "
    "--no-prove: only a proof in DIR/proofs is used.",
)
@click.option(
    "--to-end",
    is_flag=True,
    help="With --prove: enclose the exact motion to the end of the run.",
)
@ALLOW_PYTHON
@AS_JSON
@quiet_option("Print no progress, no hints and no warnings of results; problems are still printed.")
def command(
    configs: tuple[Path, ...],
    output: Path,
    members: tuple[int, ...],
    changes: tuple[str, ...],
    engine: str | None,
    force: bool,
    prove: bool | None,
    to_end: bool,
    allow_python: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Integrate configs and store their results.

    Each CONFIG is a YAML file (see `rbstab schema`). If one of them has an error, nothing is run. A
    finished run is not run again; its stored result is used. A different result of the same name is
    never overwritten. A run that does not complete is stored with its status, and the next one
    starts.

    The results are stored as soon as they are computed. Then the program proves what it can about
    each motion within some seconds, stores that too, and ends with the answers: whether the motion
    from this start comes to rest, and whether all motions that stay in the range end in one rest
    state.

    With --member N each CONFIG is the plan of a sweep. Its member N is integrated as a single run
    and stored as DIR/PLAN-memberN.h5. The plan may be the copy in the sweep's folder:
    DIR/PLAN/plan.yaml.
    """
    if to_end and not prove:
        raise click.UsageError("--to-end needs --prove")
    if engine is not None:
        refuse_engine_change(changes)
        changes = (*changes, f"integration.engine={engine}")
    with keep_imports():
        loaded = (
            load_members(configs, members, changes, output, allow_python=allow_python)
            if members
            else {
                (str(path), path.stem): config
                for path, config in load_all(configs, changes, allow_python=allow_python).items()
            }
        )
        _import_engines({config.integration.engine for config in loaded.values()})
    targets = _targets(loaded, output)
    tried = check_results_folder(output, targets.values(), force=force)
    if tried and prove is not False:
        check_proofs_folder(
            output, lambda: has_all_proofs(output, loaded.values(), brief=prove is None)
        )
    batch = Batch(output, force=force, prove=prove, to_end=to_end, quiet=quiet)
    printed = as_json
    try:
        for (label, stem), config in loaded.items():
            batch.run(label, config, targets[label, stem])
        if not printed:
            printed = True
            _print_table(batch.finished)
        batch.prove_all()
    except KeyboardInterrupt:
        batch.say_interrupted(len(loaded))
    if not printed:
        _print_table(batch.finished)
    _print_answers(batch.finished, as_json=as_json, quiet=quiet)
    if batch.finished and not quiet and batch.exit_code != exit_codes.INTERRUPTED:
        click.echo(f"Next: {_next_command(batch.finished, output)}", err=True)
    raise click.exceptions.Exit(batch.exit_code)


def _next_command(runs: "list[Finished]", output: Path) -> str:
    """Return the command that shows the run, or the report of all runs."""
    from rbstab.files.shell_words import shell_word

    paths = [shell_word(finished.run.path) for finished in runs]
    if len(paths) == 1:
        return f"rbstab show {paths[0]}"
    few = len(paths) <= MAX_NAMED
    return f"rbstab report {' '.join(paths) if few else shell_word(output)}"


def _import_engines(names: set[str]) -> None:
    """Import all that a run needs; an engine that is missing is reported by its first run."""
    import rbstab.experiment.run_to_file  # noqa: F401 (imported here for later)
    from rbstab.integrate.engines import EngineMissingError, engine

    for name in names:
        with suppress(EngineMissingError):
            engine(name)


def _targets(names: Iterable[tuple[str, str]], output: Path) -> dict[tuple[str, str], Path]:
    """Return the result file of each label and stem.

    Raises:
        UsageError: Two configs would write the same file.
    """
    owners: dict[Path, str] = {}
    targets = {}
    for label, stem in names:
        target = output / f"{stem}.h5"
        if target in owners:
            raise click.UsageError(
                f"{owners[target]} and {label} would both write {target}. "
                "Run them one by one into different folders with -o."
            )
        owners[target] = label
        targets[label, stem] = target
    return targets


def _run_data(finished: Finished) -> dict[str, Any]:
    from rbstab.experiment.convergence.with_proof import with_later_proof
    from rbstab_cli.output.facts import run_data

    run, proof = finished.run, finished.proof
    config = finished.config
    data = run_data(with_later_proof(run.result, config, proof), config, proof)
    return {"file": str(run.path), "computed": run.computed, **data}


def _print_table(runs: list[Finished]) -> None:
    """Print the numbers of runs: a row for each."""
    from rbstab.analysis.lyapunov import ENERGY_SCALE
    from rbstab.experiment.answers.outcome import outcome_of
    from rbstab.experiment.answers.run_answer import SETTLED, SETTLED_DRIVEN, STARTS_AT_REST
    from rbstab.experiment.summary import (
        at_least,
        at_rest_from,
        is_driven,
        lyapunov_function_of,
        summary_of,
    )
    from rbstab.integrate.status import RunStatus
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    if not runs:
        return
    numbers = (
        *("v(0) [J]", "v(end) [J]", f"|r|/{ENERGY_SCALE}", "at rest from [s]"),
        *("max|E| [m]", "max|θ2| [rad]", "time [s]"),
    )
    table = new_table(
        "file", "outcome", "status", *numbers, words=("outcome", "status"), numbers=numbers
    )
    settling: list[str] = []
    for finished in runs:
        run = finished.run
        s, result = summary_of(run.result), run.result
        completed = result.status == RunStatus.COMPLETED
        settling.append(at_rest_from(result))
        add_row(
            table,
            str(run.path),
            outcome_of(result, finished.config).kind.words,
            result.status if completed else f"{result.status} at {s.end_time:.4g} s",
            number(s.lyapunov_start),
            # The result may store v - ε, which does not end at zero; this column is v.
            number(float(lyapunov_function_of(result)[-1])),
            number(s.relative_residual, 2),
            settling[-1] or "-",
            at_least(s.displacement_resolved) + number(s.peak_distance),
            at_least(s.pitch_resolved) + number(s.largest_pitch),
            number(float(result.attributes["wall_time"]), 3),
            style=None if completed else "yellow",
        )
    driven = {is_driven(finished.run.result) for finished in runs}
    meaning = SETTLED_DRIVEN if driven == {True} else SETTLED
    if len(driven) > 1:
        meaning += f"; where inputs supply power, {SETTLED_DRIVEN}"
    before = "; ≤: not later, the samples do not show it better" if "≤" in "".join(settling) else ""
    never = "" if all(settling) else "; -: not in this run"
    at_start = f"; {STARTS_AT_REST}" if "0" in settling else ""
    print_table(table, f"At rest: {meaning} from then on{at_start}{before}{never}.")


def _print_answers(runs: list[Finished], *, as_json: bool, quiet: bool) -> None:
    """Print the answers of runs: their words, and for a few runs their sentences.

    The warnings of the results go to stderr, unless the command is quiet.
    """
    from rbstab_cli.output.result_warnings import own_warnings, print_result_warnings

    warnings = {f.run.path: [] if quiet else own_warnings(f.run.result, f.config) for f in runs}
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json([_run_data(finished) for finished in runs])
        for path, own in warnings.items():
            print_result_warnings(path, own)
        return
    from rbstab.experiment.answers.rest_modes import rest_modes
    from rbstab.experiment.answers.run_answer import answer_beside
    from rbstab_cli.output.answers import print_answers

    # CONFIG alone would leave out -o, --set and --member.
    answers = [
        (f.run.path, f.config, answer_beside(f.run.result, f.config, f.proof).naming(REPEATED))
        for f in runs
    ]
    print_answers(answers, warnings)
    modes = rest_modes(runs[0].run.result, runs[0].config) if len(runs) == 1 else None
    if modes is not None:
        click.echo(f"  {'Modes:':<13}{modes}.")
