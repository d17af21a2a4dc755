"""The runs of one command: integrated and stored one after the other, then proved."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.convergence.convergence import Enclose
    from rbstab.experiment.store_run import FiledRun
    from rbstab.experiment.stored_proof.proof import Proof

MAX_NAMED = 6
"""The most runs that a message names."""


class Finished(NamedTuple):
    """A finished run with its label, its config, and the proof of its rest states, if any."""

    label: str
    config: "Config"
    run: "FiledRun"
    proof: "Proof | None"


class Batch:
    """The runs of one command, executed one after the other; then their proofs."""

    def __init__(
        self, output: Path, *, force: bool, prove: bool | None, to_end: bool, quiet: bool
    ) -> None:
        self.output = output
        self.force = force
        self.prove = prove
        self.to_end = to_end
        self.quiet = quiet
        self.finished: list[Finished] = []
        self.begun: tuple[Config, Path] | None = None
        self.all_stored = False
        self.proved = 0
        self.exit_code = exit_codes.OK

    def run(self, label: str, config: "Config", target: Path) -> None:
        """Integrate a config and store its result, with what a proof in the folder says."""
        from rbstab.config.build import problem_of
        from rbstab.experiment.proof_cache import cached_proof
        from rbstab.experiment.run_to_file import run_to_file
        from rbstab.integrate.engines import EngineMissingError
        from rbstab.integrate.status import RunStatus
        from rbstab.store.errors import StoreError
        from rbstab_cli.output.progress import compiling, simulated_time

        self.begun = config, target
        problem = problem_of(config)
        try:
            proof = cached_proof(self.output, config)
            with simulated_time(
                Path(label).name,
                config.integration.duration,
                wanted=not self.quiet,
                before=compiling(config.integration.engine, len(problem.system.elements)),
            ) as progress:
                run = run_to_file(
                    config, target, problem, force=self.force, proof=proof, progress=progress
                )
        except EngineMissingError as error:
            raise click.UsageError(str(error)) from error
        except StoreError as error:
            click.echo(f"{label}: {error}", err=True)
            self.exit_code = exit_codes.STORAGE
            return
        self.finished.append(Finished(label, config, run, proof))
        self.begun = None
        self._print(label, run)
        if run.result.status != RunStatus.COMPLETED and self.exit_code == exit_codes.OK:
            self.exit_code = exit_codes.NOT_COMPLETED

    def prove_all(self) -> None:
        """Prove what is missing about the finished runs, and store it with them."""
        self.all_stored = True
        if self.prove is False:
            return
        from rbstab_cli.output.progress import working

        for number, finished in enumerate(self.finished):
            with working(f"{Path(finished.label).name}: proof", wanted=not self.quiet):
                self.finished[number] = self._proved(finished)
            self.proved = number + 1

    def _proved(self, finished: Finished) -> Finished:
        """Return a run with its proof; a proof that cannot be stored leaves the run as it is."""
        from rbstab.config.build import problem_of
        from rbstab.experiment.proof_cache import OLDER, is_older, proof_for
        from rbstab.experiment.run_to_file import prove_run
        from rbstab.store.errors import StoreError

        label, config, run, _ = finished
        problem = problem_of(config)
        try:
            if is_older(self.output, config):
                click.echo(f"{label}: {OLDER}", err=True)
            proof = proof_for(self.output, config, problem, brief=self.prove is None)
            proved = prove_run(run, config, problem, proof, self._enclose())
        except StoreError as error:
            click.echo(f"{label}: {error}", err=True)
            self.exit_code = exit_codes.STORAGE
            return finished
        return Finished(label, config, proved, proof)

    def say_interrupted(self, count: int) -> None:
        """Say how many of the runs are stored after an interrupt."""
        done = count if self.all_stored else len(self.finished) + self._has_stored_unfinished()
        without = self.finished[self.proved :] if self.all_stored else []
        names = ", ".join(str(finished.run.path) for finished in without[:MAX_NAMED])
        more = f" and {len(without) - MAX_NAMED} more" if len(without) > MAX_NAMED else ""
        proofs = f"; the proofs of {names}{more} are missing" if without else ""
        click.echo(f"Interrupted: {done} of {count} runs are stored{proofs}.", err=True)
        resume = "again to resume" if done else "to start again from t = 0"
        click.echo(f"Run the same command {resume}.", err=True)
        self.exit_code = exit_codes.INTERRUPTED

    def _has_stored_unfinished(self) -> bool:
        """Return whether the run that was interrupted is stored: the interrupt came afterwards."""
        from rbstab.config.load import run_id
        from rbstab.store.errors import StoreError
        from rbstab.store.result import open_result

        if self.begun is None:
            return False
        config, target = self.begun
        try:
            return open_result(target).run_id == run_id(config)
        except StoreError:
            return False

    def _enclose(self) -> "Enclose":
        from rbstab.experiment.convergence.convergence import Enclose

        if self.prove is None:
            return Enclose.BRIEFLY
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
        from rbstab.experiment.answers.check_words import comparison
        from rbstab.experiment.run_certificate import CERTIFIED_REGION, GLOBAL_STABILITY
        from rbstab.experiment.stored_certificate import certificate_lines
        from rbstab_cli.output.certificate import VIOLATED

        # What a proof refutes is no fault of the run; the answers say it.
        proved = {GLOBAL_STABILITY, CERTIFIED_REGION}
        for line in certificate_lines(run.result):
            if line.verdict == VIOLATED and line.check not in proved:
                click.echo(
                    f"{label}: the Lyapunov argument fails: "
                    f"{line.check}: {line.quantity}: {comparison(line)}",
                    err=True,
                )
