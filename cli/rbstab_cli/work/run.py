"""`rbstab run`: configs, or members of plans, integrated, stored and proved."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.config.schema import Config
from rbstab.experiment.answers.outcome import outcome_of
from rbstab.experiment.answers.rest_modes import rest_modes
from rbstab.experiment.answers.run_answer import (
    SETTLED,
    SETTLED_DRIVEN,
    STARTS_AT_REST,
    answer_beside,
)
from rbstab.experiment.convergence.with_proof import with_later_proof
from rbstab.experiment.summary import (
    at_least,
    at_rest_from,
    is_driven,
    lyapunov_function_of,
    summary_of,
)
from rbstab.files.shell_words import shell_word
from rbstab.integrate.status import RunStatus
from rbstab_cli import exit_codes
from rbstab_cli.inputs import load_configs, load_members, refuse_engine_change
from rbstab_cli.output.files import check_proofs_folder, check_results_folder
from rbstab_cli.output.runs import (
    own_warnings,
    print_answers,
    print_result_warnings,
    print_statement,
    run_data,
)
from rbstab_cli.printing import Table, hint, is_quiet, number, print_json
from rbstab_cli.work.batch import MAX_NAMED, Batch, Finished

REPEATED = "the same command with --prove"
"""The command that makes a proof, as the answers of this command name it."""


def run(
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
) -> int:
    """Run the configs and print the results."""
    if engine is not None:
        refuse_engine_change(changes)
        changes = (*changes, f"integration.engine={engine}")
    if members:
        loaded = load_members(configs, members, changes, output, allow_python=allow_python)
    else:
        found = load_configs(configs, changes, allow_python=allow_python)
        loaded = {(str(path), path.stem): config for path, config in found.items()}
    jobs = _by_target(loaded, output)
    tried = check_results_folder(output, jobs, force=force)
    if tried and prove is not False:
        check_proofs_folder(output)
    batch = Batch(output, force=force, prove=prove, to_end=to_end)
    printed = as_json
    try:
        for target, (label, config) in jobs.items():
            batch.run(label, config, target)
        if not printed:
            printed = True
            _print_table(batch.finished)
        batch.prove_all()
    except KeyboardInterrupt:
        batch.say_interrupted(len(jobs))
    if not printed:
        _print_table(batch.finished)
    _print_answers(batch.finished, as_json=as_json)
    if batch.finished and batch.exit_code != exit_codes.INTERRUPTED:
        paths = [shell_word(finished.run.path) for finished in batch.finished]
        every = paths if len(paths) <= MAX_NAMED else [shell_word(output)]
        hint(f"Next: rbstab {'show' if len(paths) == 1 else 'report'} {' '.join(every)}")
    return batch.exit_code


def _by_target(
    configs: Mapping[tuple[str, str], Config], output: Path
) -> dict[Path, tuple[str, Config]]:
    """Return configs with their labels by their result files.

    Raises:
        UsageError: Two configs would write the same file.
    """
    jobs: dict[Path, tuple[str, Config]] = {}
    for (label, stem), config in configs.items():
        target = output / f"{stem}.h5"
        if target in jobs:
            raise click.UsageError(
                f"{jobs[target][0]} and {label} would both write {target}. "
                "Run them one by one into different folders with -o."
            )
        jobs[target] = label, config
    return jobs


def _run_data(finished: Finished) -> dict[str, Any]:
    _, config, run, proof = finished
    data = run_data(with_later_proof(run.result, config, proof), config, proof)
    return {"file": str(run.path), "computed": run.computed, **data}


def _print_table(runs: list[Finished]) -> None:
    """Print the numbers of runs: a row for each."""
    if not runs:
        return
    numbers = (
        *("v(0) [J]", "v(end) [J]", f"|r|/{ENERGY_SCALE}", "at rest from [s]"),
        *("max|E| [m]", "max|θ2| [rad]", "time [s]"),
    )
    words = ("outcome", "status")
    table = Table("file", *words, *numbers, words=words, numbers=numbers)
    for finished in runs:
        result = finished.run.result
        s = summary_of(result)
        completed = result.status == RunStatus.COMPLETED
        table.add(
            str(finished.run.path),
            outcome_of(result, finished.config).kind.words,
            result.status if completed else f"{result.status} at {s.end_time:.4g} s",
            number(s.lyapunov_start),
            # The result may store v - ε, which does not end at zero; this column is v.
            number(float(lyapunov_function_of(result)[-1])),
            number(s.relative_residual, 2),
            at_rest_from(result) or "-",
            at_least(s.displacement_resolved) + number(s.peak_distance),
            at_least(s.pitch_resolved) + number(s.largest_pitch),
            number(float(result.attributes["wall_time"]), 3),
            style=None if completed else "yellow",
        )
    table.print(_note(runs))


def _note(runs: list[Finished]) -> str:
    """Return what the column `at rest from` means."""
    settling = [at_rest_from(finished.run.result) for finished in runs]
    driven = {is_driven(finished.run.result) for finished in runs}
    meaning = SETTLED_DRIVEN if driven == {True} else SETTLED
    if len(driven) > 1:
        meaning += f"; where inputs supply power, {SETTLED_DRIVEN}"
    before = "; ≤: not later, the samples do not show it better" if "≤" in "".join(settling) else ""
    never = "" if all(settling) else "; -: not in this run"
    at_start = f"; {STARTS_AT_REST}" if "0" in settling else ""
    return f"At rest: {meaning} from then on{at_start}{before}{never}."


def _print_answers(runs: list[Finished], *, as_json: bool) -> None:
    """Print the answers of runs: their words, and for a few runs their sentences.

    The warnings of the results go to stderr, unless the command is quiet.
    """
    shown = [] if is_quiet() else runs
    warnings = {f.run.path: own_warnings(f.run.result, f.config) for f in shown}
    if as_json:
        print_json([_run_data(finished) for finished in runs])
        for path, own in warnings.items():
            print_result_warnings(path, own)
        return
    # CONFIG alone would leave out -o, --set and --member.
    answers = [
        (f.run.path, f.config, answer_beside(f.run.result, f.config, f.proof).naming(REPEATED))
        for f in runs
    ]
    print_answers(answers, warnings)
    modes = rest_modes(runs[0].run.result, runs[0].config) if len(runs) == 1 else None
    if modes is not None:
        print_statement("Modes", str(modes))
