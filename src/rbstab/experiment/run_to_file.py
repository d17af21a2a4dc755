"""Run a config and write its result file; finished and different results are kept."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rbstab.config.build import problem_of
from rbstab.config.load import resolved_yaml, run_id
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import Enclose, stored_convergence
from rbstab.experiment.convergence.with_proof import with_proof
from rbstab.experiment.run_certificate import proved_checks
from rbstab.experiment.simulate import simulate_problem
from rbstab.experiment.store_run import (
    FiledRun,
    aside_path,
    depends_on_machine,
    existing_result,
    refuse_different,
    store_run,
)
from rbstab.experiment.stored_run import certificate_lines
from rbstab.integrate.problem import Problem, Progress
from rbstab.store.disk.atomic import remove_abandoned
from rbstab.store.disk.paths import check_writable, path_exists
from rbstab.store.errors import StoreError
from rbstab.store.result import Result, open_result

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof


def run_to_file(  # noqa: PLR0913 (what to run; how, and into which file)
    config: Config,
    path: Path,
    problem: Problem | None = None,
    *,
    force: bool = False,
    proof: "Proof | None" = None,
    enclose: Enclose = Enclose.NOTHING,
    progress: Progress | None = None,
) -> FiledRun:
    """Run a config and write its result, unless the finished result exists.

    A run that depends on the machine, such as one that hit its time limit, is repeated. Its result
    is replaced only by one that is at least as good (see `store_run`).

    Args:
        config: The config.
        path: The result file.
        problem: The problem of the config, if it is built already.
        force: Repeat a finished identical run; move a different or a better result aside.
        proof: As in `simulate`; it is added to a finished run whose certificate lacks its checks.
        enclose: As in `simulate`; the motion of a finished run is enclosed further if needed.
        progress: As in `simulate`.

    Raises:
        ResultExistsError: A different result, or a damaged one, has that name (without `force`).
        StoreError: The result cannot be written.
        EngineMissingError: As in `simulate`.
    """
    problem = problem or problem_of(config)
    old = existing_result(path, force=force)
    identical = old is not None and old.run_id == run_id(config)
    text = resolved_yaml(config)

    def is_final(stored: Result) -> bool:
        is_current = stored.config == text and not depends_on_machine(stored)
        return is_current and _has_proof(stored, problem, proof, enclose)

    if old is not None and identical and not force:
        if old.config != text:
            # The motion is the same; what is wanted of it has changed.
            old = store_run(path, replace(old, config=text), is_final).result
        if not depends_on_machine(old):
            # Its writer may have been killed as soon as the result was complete.
            remove_abandoned(path)
            return prove_run(FiledRun(path, old), config, problem, proof, enclose)
    different = path_exists(path) and not identical
    if different and not force:
        refuse_different(path, old)
    # Checked before the run, which may take hours.
    check_writable(aside_path(path, old) if different else path)
    result = simulate_problem(config, problem, progress=progress, proof=proof, enclose=enclose)
    # Another process may have written this file in the meantime.
    return store_run(path, result, is_final, force=force)


def prove_run(
    run: FiledRun, config: Config, problem: Problem, proof: "Proof | None", enclose: Enclose
) -> FiledRun:
    """Return a run with what its proof says, and store that with it.

    Args:
        run: The run.
        config: Its config.
        problem: The problem of the config.
        proof: The proof of its rest states.
        enclose: How far the exact motion is to be enclosed.

    Raises:
        StoreError: The result cannot be written.
    """

    def is_final(stored: Result) -> bool:
        return _has_proof(stored, problem, proof, enclose)

    if is_final(run.result):
        return run
    result = with_proof(run.result, config, problem, proof, enclose)
    return run._replace(result=store_run(run.path, result, is_final).result)


def finished_run(
    config: Config, problem: Problem, path: Path, *, proof: "Proof | None" = None
) -> Result | None:
    """Return the finished result of a config if its certificate has the checks of the proof.

    Args:
        config: The config.
        problem: Its problem.
        path: The file of the result.
        proof: The proof of its rest states; None: no checks are needed.

    Returns:
        The result; None if it is missing, not final, or lacks the checks.
    """
    try:
        result = open_result(path)
    except StoreError:
        return None
    same = result.run_id == run_id(config) and not depends_on_machine(result)
    return result if same and _has_proof(result, problem, proof) else None


def _has_proof(
    result: Result, problem: Problem, proof: "Proof | None", enclose: Enclose = Enclose.NOTHING
) -> bool:
    """Return whether a result has the checks that a proof decides, and is enclosed so far."""
    convergence = stored_convergence(result.attributes)
    enclosed = Enclose.NOTHING if convergence is None else convergence.enclosed
    if not enclosed.covers(enclose):
        return False
    stored = {line.check: line.verdict for line in certificate_lines(result)}
    return proof is None or all(
        stored.get(c.check) == c.verdict for c in proved_checks(problem, proof)
    )
