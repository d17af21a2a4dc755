"""Run a config and write its result file; finished and different results are kept."""

from pathlib import Path
from typing import NamedTuple

from rbstab.config.build import problem_of
from rbstab.config.load import run_id
from rbstab.config.schema import Config
from rbstab.experiment.proof import Proof
from rbstab.experiment.run_certificate import GROUP, proved_checks
from rbstab.experiment.simulate import simulate_problem
from rbstab.integrate.problem import Problem, Progress
from rbstab.integrate.status import RunStatus
from rbstab.store.atomic import move_aside
from rbstab.store.errors import ResultExistsError, StoreError
from rbstab.store.result import Result
from rbstab.store.run_file import open_result, write_result


class FiledRun(NamedTuple):
    """A run and its file.

    Attributes:
        path: The file.
        result: The result in it.
        computed: Whether the run was integrated now; otherwise its finished result was read.
        moved_aside: The new path of a different result that had this name; None if there was none.
    """

    path: Path
    result: Result
    computed: bool
    moved_aside: Path | None


def run_to_file(  # noqa: PLR0913 (what to run; how, and into which file)
    config: Config,
    path: Path,
    problem: Problem | None = None,
    *,
    force: bool = False,
    proof: Proof | None = None,
    progress: Progress | None = None,
) -> FiledRun:
    """Run a config and write its result, unless the finished result exists.

    Args:
        config: The config.
        path: The result file.
        problem: The problem of the config, if it is built already.
        force: Repeat a finished identical run; move a different result of that name aside.
        proof: As in `simulate`; a finished run is repeated if its certificate lacks its checks.
        progress: As in `simulate`.

    Raises:
        ResultExistsError: A different result, or a damaged one, has that name (without `force`).
        StoreError: The result cannot be written.
        EngineMissingError: As in `simulate`.
    """
    problem = problem or problem_of(config)
    old = _existing(path, force=force)
    identical = old is not None and old.run_id == run_id(config)
    if old is not None and identical and not force and _is_final(old, problem, proof):
        return FiledRun(path, old, computed=False, moved_aside=None)
    different = path.exists() and not identical
    if different and not force:
        _refuse(path, old)
    result = simulate_problem(config, problem, progress=progress, proof=proof)
    aside = None
    if different:
        aside = _unused_path(path, old.run_id[:8] if old is not None else "damaged")
        move_aside(path, aside)
    if identical:
        _check_unchanged(path, result)
    # `write_result` raises an error if another process has written this file in the meantime.
    write_result(path, result, replace=identical)
    return FiledRun(path, result, computed=True, moved_aside=aside)


def finished_run(
    config: Config, problem: Problem, path: Path, *, proof: Proof | None = None
) -> Result | None:
    """Return the finished result of a config if its certificate has the checks of the proof.

    Returns:
        The result; None if it is missing, not final, or lacks the checks.
    """
    try:
        found = open_result(path)
    except StoreError:
        return None
    final = found.run_id == run_id(config) and _is_final(found, problem, proof)
    return found if final else None


def _existing(path: Path, *, force: bool) -> Result | None:
    if not path.exists():
        return None
    try:
        return open_result(path)
    except StoreError as error:
        if force:
            return None
        raise ResultExistsError(f"{error}. Use --force to move it aside.") from error


def _is_final(result: Result, problem: Problem, proof: Proof | None) -> bool:
    return not RunStatus(result.status).depends_on_machine and _has_proof(result, problem, proof)


def _has_proof(result: Result, problem: Problem, proof: Proof | None) -> bool:
    """Return whether the certificate of a result has the checks that a proof decides."""
    if proof is None:
        return True
    names = [f"{GROUP}/{column}" for column in ("check", "verdict")]
    if any(name not in result for name in names):
        return False
    stored = dict(zip(*(result[name].tolist() for name in names), strict=True))
    return all(stored.get(c.name) == c.verdict for c in proved_checks(problem, proof))


def _refuse(path: Path, old: Result | None) -> None:
    description = f"run {old.run_id[:8]}" if old is not None else "another file"
    raise ResultExistsError(
        f"{path} holds a different result ({description}); it is not overwritten. "
        "Choose another folder with -o, or use --force to move it aside."
    )


def _check_unchanged(path: Path, result: Result) -> None:
    """Check that no other process has replaced the result that is to be overwritten."""
    now = open_result(path) if path.exists() else None
    if now is not None and now.run_id != result.run_id:
        _refuse(path, now)


def _unused_path(path: Path, middle: str) -> Path:
    paths = [path.with_name(f"{path.stem}.{middle}{path.suffix}")]
    while paths[-1].exists():
        paths.append(path.with_name(f"{path.stem}.{middle}-{len(paths)}{path.suffix}"))
    return paths[-1]
