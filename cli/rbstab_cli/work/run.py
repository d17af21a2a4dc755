"""`rbstab run`: configs, or members of plans, integrated, stored and proved."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.config.schema import Config
from rbstab.experiment.answers.assessed_run import AssessedRun
from rbstab.experiment.answers.facts import FACTS
from rbstab.experiment.answers.rest_modes import rest_modes
from rbstab.experiment.answers.rounded import NO_VALUE
from rbstab.experiment.answers.run_answer import SETTLED, SETTLED_DRIVEN, STARTS_AT_REST
from rbstab.experiment.summary import UNKNOWN_STEPS
from rbstab.files.text import shell_word
from rbstab_cli import exit_codes
from rbstab_cli.inputs import load_configs, load_members, refuse_engine_change
from rbstab_cli.output.files import check_proofs_folder, check_results_folder
from rbstab_cli.output.runs import (
    print_answers,
    print_result_warnings,
    print_run_table,
    print_statement,
    run_data,
    run_warnings,
)
from rbstab_cli.printing import hint, is_quiet, print_json
from rbstab_cli.work.batch import MAX_NAMED, Batch, Finished

NUMBERS = (
    *("v(0)", "v(end)", f"|r|/{ENERGY_SCALE}", "at rest from"),
    *("peak |E|", "peak |θ2|", "wall time"),
)
"""The facts in the table of runs that are numbers."""

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
        configs_by_path = load_configs(configs, changes, allow_python=allow_python)
        loaded = {(str(path), path.stem): config for path, config in configs_by_path.items()}
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
            _print_table([finished.run_with_proof for finished in batch.finished])
        batch.prove_all()
    except KeyboardInterrupt:
        batch.say_interrupted(len(jobs))
    if not printed:
        _print_table([finished.run_with_proof for finished in batch.finished])
    _print_answers(batch.finished, as_json=as_json)
    if batch.finished and batch.exit_code != exit_codes.INTERRUPTED:
        paths = [shell_word(finished.run.path) for finished in batch.finished]
        every = paths if len(paths) <= MAX_NAMED else [shell_word(output)]
        hint(f"Next: rbstab {'show' if len(paths) == 1 else 'report'} {' '.join(every)}")
    return batch.exit_code


def _by_target(
    configs: Mapping[tuple[str, str], Config], output: Path
) -> dict[Path, tuple[str, Config]]:
    """Return configs with their labels by their result files; refuse two with the same file."""
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


def _print_table(runs: Sequence[AssessedRun]) -> None:
    """Print the numbers of runs: a row for each, and what the column `at rest from` means."""
    if not runs:
        return
    settling = [FACTS["at rest from"].of(run).text for run in runs]
    driven = {run.is_driven for run in runs}
    meaning = SETTLED_DRIVEN if driven == {True} else SETTLED
    if len(driven) > 1:
        meaning += f"; where elements supply power, {SETTLED_DRIVEN}"
    before = f"; ≤: not later, {UNKNOWN_STEPS}" if "≤" in "".join(settling) else ""
    never = "; -: not in this run" if NO_VALUE in settling else ""
    at_start = f"; {STARTS_AT_REST}" if "0" in settling else ""
    note = f"At rest: {meaning} from then on{at_start}{before}{never}."
    print_run_table(runs, ("outcome", "status"), NUMBERS, note)


def _print_answers(finished: list[Finished], *, as_json: bool) -> None:
    """Print the answers of runs: their words, and for a few runs their sentences."""
    # The warnings go to stderr, unless the command is quiet.
    shown = [] if is_quiet() else finished
    warnings = {f.run.path: run_warnings(f.run.result, f.config) for f in shown}
    runs = [job.run_with_proof for job in finished]
    if as_json:
        computed = [job.run.computed for job in finished]
        print_json(
            [
                {"file": str(run.path), "computed": now, **run_data(run)}
                for run, now in zip(runs, computed, strict=True)
            ]
        )
        for path, texts in warnings.items():
            print_result_warnings(path, texts)
        return
    # CONFIG alone would leave out -o, --set and --member.
    print_answers(runs, warnings, REPEATED)
    modes = rest_modes(runs[0].result, runs[0].config) if len(runs) == 1 else None
    if modes is not None:
        print_statement("Modes", str(modes))
