"""The runs of one command: integrated and stored one after the other, then proved."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rbstab.config.build import problem_of
from rbstab.config.load import run_id
from rbstab.config.schema import Config
from rbstab.experiment.answers.assessed_run import AssessedRun
from rbstab.experiment.answers.check_words import comparison
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.proof_cache import OLDER, cached_proof, is_older, proof_for
from rbstab.experiment.run_certificate import CERTIFIED_REGION, GLOBAL_STABILITY
from rbstab.experiment.run_to_file import prove_run, run_to_file
from rbstab.experiment.store_run import FiledRun
from rbstab.experiment.stored_run import certificate_lines
from rbstab.integrate.status import RunStatus
from rbstab.store.errors import StoreError
from rbstab.store.result import open_result
from rbstab_cli import exit_codes
from rbstab_cli.output.progress import compiling, working
from rbstab_cli.output.runs import VIOLATED
from rbstab_cli.printing import hint, say

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

MAX_NAMED = 6
"""The most runs that a message names."""


class Finished(NamedTuple):
    """A finished run with its label, its config, and the proof of its rest states, if any."""

    label: str
    config: Config
    run: FiledRun
    proof: "Proof | None"

    @property
    def run_with_proof(self) -> AssessedRun:
        """The run with all that is known of it."""
        run = AssessedRun(self.run.path, self.run.result, self.config)
        run.proof = self.proof
        return run


class Batch:
    """The runs of one command, executed one after the other; then their proofs."""

    def __init__(self, output: Path, *, force: bool, prove: bool | None, to_end: bool) -> None:
        self.output = output
        self.force = force
        self.prove = prove
        self.enclose = Enclose.TO_END if to_end else Enclose.UNTIL_PROVED
        if prove is None:
            self.enclose = Enclose.BRIEFLY
        self.finished: list[Finished] = []
        self.begun: tuple[Config, Path] | None = None
        self.all_stored = False
        self.proved = 0
        self.exit_code = exit_codes.OK

    def run(self, label: str, config: Config, target: Path) -> None:
        """Integrate a config and store its result, with what a proof in the folder says.

        Args:
            label: The name of the run in messages.
            config: The config.
            target: The file of the result.
        """
        self.begun = config, target
        problem = problem_of(config)
        integration = config.integration
        try:
            proof = cached_proof(self.output, config)
            with working(Path(label).name) as work:
                work.update(compiling(integration.engine, len(problem.system.elements)))
                progress = work.simulated(integration.duration)
                run = run_to_file(
                    config, target, problem, force=self.force, proof=proof, progress=progress
                )
        except StoreError as error:
            self._not_stored(label, error)
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
        for number, finished in enumerate(self.finished):
            with working(f"{Path(finished.label).name}: proof"):
                self.finished[number] = self._proved(finished)
            self.proved = number + 1

    def _proved(self, finished: Finished) -> Finished:
        """Return a run with its proof; a proof that cannot be stored leaves the run as it is."""
        label, config, run, _ = finished
        problem = problem_of(config)
        try:
            if is_older(self.output, config):
                say(f"{label}: {OLDER}")
            proof = proof_for(self.output, config, problem, brief=self.prove is None)
            if config.bound is not None:
                # Imported late: few configs state any.
                from rbstab.experiment.disturbed.stored import bound_for

                bound_for(self.output, config)
            proved = prove_run(run, config, problem, proof, self.enclose)
        except StoreError as error:
            self._not_stored(label, error)
            return finished
        return Finished(label, config, proved, proof)

    def _not_stored(self, label: str, error: StoreError) -> None:
        say(f"{label}: {error}")
        self.exit_code = exit_codes.STORAGE

    def say_interrupted(self, count: int) -> None:
        """Say how many of the runs are stored after an interrupt."""
        from rbstab.report.model.words import listed

        done = count if self.all_stored else len(self.finished) + self._has_stored_unfinished()
        without = self.finished[self.proved :] if self.all_stored else []
        names = listed((str(finished.run.path) for finished in without), MAX_NAMED)
        proofs = f"; the proofs of {names} are missing" if without else ""
        say(f"Interrupted: {done} of {count} runs are stored{proofs}.")
        resume = "again to resume" if done else "to start again from t = 0"
        say(f"Run the same command {resume}.")
        self.exit_code = exit_codes.INTERRUPTED

    def _has_stored_unfinished(self) -> bool:
        """Return whether the run that was interrupted is stored: the interrupt came afterwards."""
        if self.begun is None:
            return False
        config, target = self.begun
        try:
            return open_result(target).run_id == run_id(config)
        except StoreError:
            return False

    def _print(self, label: str, run: FiledRun) -> None:
        result = run.result
        if run.moved_aside is not None:
            say(f"{label}: the previous result was moved to {run.moved_aside}")
        if run.kept:
            say(
                f"{label}: {run.path} already holds a result of this config that is as good or "
                "better; it is kept"
            )
        if result.status != RunStatus.COMPLETED:
            say(f"{label}: {result.status}: {result.attributes['status_detail']}")
        elif not run.kept:
            seconds = float(result.attributes["wall_time"])
            done = f"{result.status} in {seconds:.2f} s -> {run.path}"
            if not run.computed:
                done = f"already done ({run.path}). Rerun it with --force."
            hint(f"{label}: {done}")
        # What a proof refutes is no fault of the run; the answers say it.
        proved = {GLOBAL_STABILITY, CERTIFIED_REGION}
        for line in certificate_lines(result):
            if line.verdict == VIOLATED and line.check not in proved:
                failure = f"{line.check}: {line.quantity}: {comparison(line)}"
                say(f"{label}: the Lyapunov argument fails: {failure}")
