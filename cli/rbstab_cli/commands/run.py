"""`rbstab run`."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab.processes.imports import keep_imports
from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.engine import refuse_engine_change
from rbstab_cli.arguments.members import MEMBERS, load_members
from rbstab_cli.arguments.options import AS_JSON, CHANGES, QUIET, results_folder
from rbstab_cli.arguments.outputs import check_results_folder

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.convergence.convergence import Enclose
    from rbstab.experiment.run_to_file import FiledRun


@click.command("run")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=click.Path(path_type=Path)
)
@results_folder("CONFIG.yaml gives DIR/CONFIG.h5")
@MEMBERS
@CHANGES
@click.option(
    "--engine",
    type=click.Choice(["scipy", "heyoka"]),
    help="Integrator: scipy, or heyoka (compiled); default: from each config.",
)
@click.option(
    "--force",
    is_flag=True,
    help="Rerun finished runs; move a different result of the same name aside.",
)
@click.option(
    "--prove",
    is_flag=True,
    help="Prove the rest states and their regions, or read this proof from DIR/proofs. Then "
    "enclose the exact motion until convergence is proved, for at most 2000 steps.",
)
@click.option(
    "--to-end",
    is_flag=True,
    help="With --prove: enclose the exact motion to the end of the run.",
)
@AS_JSON
@QUIET
def command(
    configs: tuple[Path, ...],
    output: Path,
    members: tuple[int, ...],
    changes: tuple[str, ...],
    engine: str | None,
    force: bool,
    prove: bool,
    to_end: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Integrate configs and store their results.

    Each CONFIG is a YAML file (see `rbstab schema`). If one of them has an error, nothing is run. A
    finished run is not run again; its stored result is used. A different result of the same name is
    never overwritten. A run that does not complete is stored with its status, and the next one
    starts.

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
            load_members(configs, members, changes, output)
            if members
            else {
                (str(path), path.stem): config
                for path, config in load_all(configs, changes).items()
            }
        )
        _import_engines({config.integration.engine for config in loaded.values()})
    targets = _targets(loaded, output)
    check_results_folder(output, targets.values())
    batch = _Batch(output, force=force, prove=prove, to_end=to_end, quiet=quiet)
    try:
        for (label, stem), config in loaded.items():
            batch.run(label, config, targets[label, stem])
    except KeyboardInterrupt:
        done = len(batch.finished) + batch.has_stored_unfinished()
        click.echo(f"Interrupted: {done} of {len(loaded)} runs are stored.", err=True)
        click.echo("Run the same command again to resume.", err=True)
        batch.exit_code = exit_codes.INTERRUPTED
    _report(batch.finished, as_json=as_json)
    if batch.finished and not quiet and batch.exit_code != exit_codes.INTERRUPTED:
        from rbstab.files.shell_words import shell_word

        click.echo(f"Next: rbstab show {shell_word(batch.finished[-1].path)}", err=True)
    raise click.exceptions.Exit(batch.exit_code)


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


class _Batch:
    """The runs of one command, executed one after the other."""

    def __init__(
        self, output: Path, *, force: bool, prove: bool, to_end: bool, quiet: bool
    ) -> None:
        self.output = output
        self.force = force
        self.prove = prove
        self.to_end = to_end
        self.quiet = quiet
        self.finished: list[FiledRun] = []
        self.begun: tuple[Config, Path] | None = None
        self.exit_code = exit_codes.OK

    def run(self, label: str, config: "Config", target: Path) -> None:
        from rbstab.config.build import problem_of
        from rbstab.experiment.proof_cache import cached_proof, proof_for
        from rbstab.experiment.run_to_file import run_to_file
        from rbstab.integrate.engines import EngineMissingError
        from rbstab.integrate.status import RunStatus
        from rbstab.store.errors import StoreError
        from rbstab_cli.output.progress import progress_bar

        self.begun = config, target
        problem = problem_of(config)
        try:
            proof = (
                proof_for(self.output, config, problem)
                if self.prove
                else cached_proof(self.output, config)
            )
            with progress_bar(
                Path(label).name, config.integration.duration, wanted=not self.quiet
            ) as progress:
                run = run_to_file(
                    config,
                    target,
                    problem,
                    force=self.force,
                    proof=proof,
                    enclose=self._enclose(),
                    progress=progress,
                )
        except EngineMissingError as error:
            raise click.UsageError(str(error)) from error
        except StoreError as error:
            click.echo(f"{label}: {error}", err=True)
            self.exit_code = exit_codes.STORAGE
            return
        self.finished.append(run)
        self.begun = None
        self._print(label, run)
        if run.result.status != RunStatus.COMPLETED and self.exit_code == exit_codes.OK:
            self.exit_code = exit_codes.NOT_COMPLETED

    def has_stored_unfinished(self) -> bool:
        """Return whether the run that was interrupted is stored: the interrupt came afterwards."""
        from rbstab.config.load import run_id
        from rbstab.store.errors import StoreError
        from rbstab.store.run_file import open_result

        if self.begun is None:
            return False
        config, target = self.begun
        try:
            return open_result(target).run_id == run_id(config)
        except StoreError:
            return False

    def _enclose(self) -> "Enclose":
        from rbstab.experiment.convergence.convergence import Enclose

        if not self.prove:
            return Enclose.NOTHING
        return Enclose.TO_END if self.to_end else Enclose.UNTIL_PROVED

    def _print(self, label: str, run: "FiledRun") -> None:
        from rbstab.integrate.status import RunStatus

        result = run.result
        if run.moved_aside is not None:
            click.echo(f"{label}: the previous result was moved to {run.moved_aside}", err=True)
        if run.kept:
            click.echo(
                f"{label}: {run.path} already holds a result of this config that is as good "
                "or better; it is kept",
                err=True,
            )
        if result.status != RunStatus.COMPLETED:
            click.echo(f"{label}: {result.status}: {result.attributes['status_detail']}", err=True)
        elif not (self.quiet or run.kept):
            seconds = float(result.attributes["wall_time"])
            done = f"{result.status} in {seconds:.2f} s -> {run.path}"
            if not run.computed:
                done = f"already done ({run.path}). Rerun it with --force."
            click.echo(f"{label}: {done}", err=True)
        self._print_violations(label, run)

    @staticmethod
    def _print_violations(label: str, run: "FiledRun") -> None:
        from rbstab_cli.output.certificate import VIOLATED, certificate_checks

        for check in certificate_checks(run.result):
            if check["verdict"] == VIOLATED:
                values = f"is {check['value']:.3g} (bound {check['bound']:.3g})"
                click.echo(
                    f"{label}: the Lyapunov argument fails: "
                    f"{check['check']}: {check['quantity']} {values}",
                    err=True,
                )


def _report(runs: list["FiledRun"], *, as_json: bool) -> None:
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json([_run_data(run) for run in runs])
    elif runs:
        _print_table(runs)


def _run_data(run: "FiledRun") -> dict[str, Any]:
    from rbstab_cli.output.facts import run_data

    return {"file": str(run.path), "computed": run.computed, **run_data(run.result)}


def _print_table(runs: list["FiledRun"]) -> None:
    from rbstab.experiment.summary import summary_of
    from rbstab.integrate.status import RunStatus
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    numbers = ("v(0) [J]", "v(end) [J]", "|r|/v(0)", "max|E| [m]", "max|θ2| [rad]", "time [s]")
    words = ("status", "verdict", "converges")
    table = new_table("file", *words, *numbers, words=words, numbers=numbers)
    for run in runs:
        s, result = summary_of(run.result), run.result
        completed = result.status == RunStatus.COMPLETED
        add_row(
            table,
            str(run.path),
            result.status if completed else f"{result.status} at {s.end_time:.4g} s",
            str(result.attributes.get("verdict", "-")),
            str(result.attributes.get("convergence", "-")),
            number(s.lyapunov_start),
            number(s.lyapunov_end),
            number(s.relative_residual, 2),
            number(s.peak_distance),
            number(s.largest_pitch),
            number(float(result.attributes["wall_time"]), 3),
            style=None if completed else "yellow",
        )
    print_table(table)
    _print_convergence(runs)


def _print_convergence(runs: list["FiledRun"]) -> None:
    """Print what is proved of the exact motions; a sentence that many runs share once."""
    from rbstab.experiment.convergence.convergence import stored_convergence

    sentences: dict[str, list[str]] = {}
    for run in runs:
        found = stored_convergence(run.result.attributes)
        if found is not None and (found.proved is not None or found.enclosed):
            sentences.setdefault(found.sentence, []).append(str(run.path))
    for sentence, paths in sentences.items():
        more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
        click.echo(f"{paths[0]}{more}: {sentence}.")
