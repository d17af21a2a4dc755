"""Running a config into its result file, without repeating or losing a run."""

from pathlib import Path
from typing import NamedTuple

from rbstab.config.load import run_id
from rbstab.config.schema import Config
from rbstab.experiment.certified import GROUP, proved_checks
from rbstab.experiment.proof import Proof
from rbstab.experiment.simulate import simulate
from rbstab.integrate.problem import Progress
from rbstab.integrate.status import RunStatus
from rbstab.store.atomic import move_aside
from rbstab.store.errors import ResultExistsError, StoreError
from rbstab.store.result import Result
from rbstab.store.run_file import open_result, write_result


class FiledRun(NamedTuple):
    """A run that stands in a file.

    path is the file, result what it holds; repeated tells whether it was run now or found there;
    moved_aside is where a different result of the same name went, if there was one.
    """

    path: Path
    result: Result
    repeated: bool
    moved_aside: Path | None


def run_to_file(
    config: Config,
    path: Path,
    *,
    force: bool = False,
    proof: Proof | None = None,
    progress: Progress | None = None,
) -> FiledRun:
    """Runs a config unless its result is there already, and writes the result.

    Args:
        config: The config.
        path: The result file.
        force: Repeat a finished identical run; move a different result of that name aside.
        proof: As in `simulate`; a finished run whose verdict does not know it is repeated.
        progress: As in `simulate`.

    Raises:
        ResultExistsError: A different result, or a damaged one, has that name (without `force`).
        StoreError: The result cannot be written; EngineMissingError: as in `simulate`.
    """
    old = _existing(path, force=force)
    identical = old is not None and old.run_id == run_id(config)
    if old is not None and identical and not force and _is_final(old, config, proof):
        return FiledRun(path, old, repeated=False, moved_aside=None)
    different = path.exists() and not identical
    if different and not force:
        _refuse(path, old)
    result = simulate(config, progress=progress, proof=proof)
    aside = None
    if different:
        aside = _free_name(path, old.run_id[:8] if old is not None else "damaged")
        move_aside(path, aside)
    if identical:
        _check_still_there(path, result)
    # A result that took the name meanwhile is met by the refusal of `write_result`.
    write_result(path, result, replace=identical)
    return FiledRun(path, result, repeated=True, moved_aside=aside)


def finished_run(config: Config, path: Path, *, proof: Proof | None = None) -> Result | None:
    """The result of a config that stands in a file, if it is finished and knows the proof."""
    try:
        found = open_result(path)
    except StoreError:
        return None
    final = found.run_id == run_id(config) and _is_final(found, config, proof)
    return found if final else None


def _existing(path: Path, *, force: bool) -> Result | None:
    if not path.exists():
        return None
    try:
        return open_result(path)
    except StoreError as error:
        if force:
            return None
        raise ResultExistsError(f"{error}; --force moves it aside") from error


def _is_final(result: Result, config: Config, proof: Proof | None) -> bool:
    return not RunStatus(result.status).depends_on_machine and _knows(result, config, proof)


def _knows(result: Result, config: Config, proof: Proof | None) -> bool:
    """Whether the certificate of a result has the lines that a proof decides."""
    if proof is None:
        return True
    names = [f"{GROUP}/{column}" for column in ("check", "verdict")]
    if any(name not in result for name in names):
        return False
    stored = dict(zip(*(result[name].tolist() for name in names), strict=True))
    return all(stored.get(c.name) == c.verdict for c in proved_checks(config, proof))


def _refuse(path: Path, old: Result | None) -> None:
    what = f"run {old.run_id[:8]}" if old is not None else "another file"
    raise ResultExistsError(
        f"{path} holds a different result ({what}); it is not overwritten: "
        "choose another folder with -o, or move it aside with --force"
    )


def _check_still_there(path: Path, result: Result) -> None:
    """Refuses to replace what another process has put in place of the result that was found."""
    now = open_result(path) if path.exists() else None
    if now is not None and now.run_id != result.run_id:
        _refuse(path, now)


def _free_name(path: Path, middle: str) -> Path:
    names = [path.with_name(f"{path.stem}.{middle}{path.suffix}")]
    while names[-1].exists():
        names.append(path.with_name(f"{path.stem}.{middle}-{len(names)}{path.suffix}"))
    return names[-1]
