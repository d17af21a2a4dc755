"""`rbstab verify`: proofs checked by a program of its own."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import click

from rbstab.config.schema import Config
from rbstab.experiment.disturbed.prove_bound import stated_in
from rbstab.experiment.disturbed.stored import StoredBound, bound_file
from rbstab.experiment.proof_cache import BOUND, PROOFS, WITHIN_TOLERANCES, proof_file
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.verification.verify import Verification
from rbstab.experiment.verification.verify import verify as verified
from rbstab.files.paths import is_dir, is_file
from rbstab.files.text import grouped, shell_word
from rbstab.proof.check.findings import Finding
from rbstab.report.reading.kinds import RESULT, Kind, kind_of
from rbstab.store.disk.paths import store_errors
from rbstab.store.document import read_model
from rbstab.store.errors import StoreError
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed, require
from rbstab_cli.inputs import load_configs
from rbstab_cli.output.files import check_target, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import as_json_text, print_json, say

NUMBER = re.compile(r"\b\d+\b")


class Checked(NamedTuple):
    """A proof, the file it is in, and what was found of it."""

    path: Path
    proof: Proof | StoredBound
    verification: Verification


def verify(
    proofs: tuple[Path, ...],
    config_path: Path | None,
    changes: tuple[str, ...],
    second: bool,
    certificate: Path | None,
    force: bool,
    allow_python: bool,
    as_json: bool,
) -> int:
    """Check proofs and print what was found."""
    several = len(proofs) > 1 or is_dir(proofs[0])
    if certificate is not None:
        if several:
            raise click.UsageError("--certificate needs the file of one proof")
        check_target(certificate, force=force)
    # Without permission a config is only read: all but the energy of code can be compared.
    named = [] if config_path is None else [config_path]
    configs = load_configs(named, changes, allow_python=allow_python or None)
    config = next(iter(configs.values()), None)
    if second:
        require("second", "--second", "codac")
    files, others = _files(proofs, config)
    readable: list[Checked] = []
    for path in files:
        checked = _checked(path, config, second=second)
        # A damaged proof does not stop the others.
        if checked is not None:
            readable.append(checked)
            if not as_json:
                _print(checked, alone=len(files) == 1, several=several)
    claiming = [checked for checked in readable if not (several and checked.proof.claims_nothing)]
    good = [checked for checked in claiming if checked.verification.verified]
    silent = len(readable) - len(claiming)
    count = len(files) - silent
    if certificate is not None and claiming:
        write_file(certificate, as_json_text(_certificate(claiming[0])) + "\n", force=force)
    if as_json and (several or claiming):
        data = list(map(_data, claiming))
        print_json(data if several else data[0])
    elif several:
        if len(files) > 1:
            _print_claims(good)
        click.echo(_counted(proofs, len(good), count, silent, others))
    return _exit_code(claiming, count)


def _exit_code(proofs: Sequence[Checked], count: int) -> int:
    """Return the exit code: whether a proof is refused or unread, or else takes too long."""
    left = [checked.verification for checked in proofs if not checked.verification.verified]
    if left and all(verification.takes_too_long for verification in left):
        return exit_codes.TOO_LONG
    # `count` has the proofs that could not be read, too.
    return exit_codes.OK if 0 < len(proofs) - len(left) == count else exit_codes.STORAGE


def _counted(named: Sequence[Path], good: int, count: int, silent: int, others: int) -> str:
    """Return how many proofs are verified, claim nothing, or cannot be checked."""
    where = f"{named[0]}: " if len(named) == 1 else ""
    ends = [f"{where}{good} of {count} proofs verified"]
    if silent:
        ends.append(f"{silent} {'file claims' if silent == 1 else 'files claim'} nothing")
    if others:
        ends.append(f"{others} within tolerances cannot be checked")
    return "; ".join(ends)


def _checked(path: Path, config: Config | None, *, second: bool) -> Checked | None:
    """Return a proof with what was found of it; print why it cannot be read, and return None."""
    try:
        proof: Proof | StoredBound
        if path.name.startswith(BOUND):
            proof = read_model(path, StoredBound)
        else:
            proof = read_model(path, Proof)
    except StoreError as error:
        say(f"error: {error}")
        return None
    count = 0
    with working(path.name) as work:

        def progress(finding: Finding) -> None:
            nonlocal count
            count += 1
            work.update(f"{count} claims checked, last: {finding.claim}")

        return Checked(path, proof, verified(proof, config, progress, second=second))


def _files(proofs: Iterable[Path], config: Config | None) -> tuple[list[Path], int]:
    """Return the files of proofs, and how many proofs within tolerances are beside them."""
    files: list[Path] = []
    others = 0
    for path in dict.fromkeys(proofs):
        if is_dir(path):
            of_folder, left = _proofs_of_folder(path, config)
            files += of_folder
            others += left
        else:
            _refuse_others(path)
            files.append(path)
    return files, others


def _proofs_of_folder(folder: Path, config: Config | None) -> tuple[list[Path], int]:
    """Return the proofs of rest states and bounds in a folder; and count the others."""
    place = folder if folder.absolute().name == PROOFS else folder / PROOFS
    paths: list[Path] = []
    with store_errors(place, "read"), suppress(FileNotFoundError, NotADirectoryError):
        paths = sorted(path for path in place.iterdir() if path.suffix == ".json")
    files = [path for path in paths if not path.name.startswith(WITHIN_TOLERANCES)]
    others = len(paths) - len(files)
    if config is not None:
        names, stated = [proof_file(folder, config).name], stated_in(config)
        if stated is not None:
            names.append(bound_file(folder, config, stated).name)
        files = [path for path in files if path.name in names]
    if not files:
        whose = " of this config" if config is not None else ""
        raise Failed(
            exit_codes.STORAGE,
            f"{folder} has no proof{whose} that can be checked. Proofs are in DIR/proofs of a "
            "folder of results DIR; `rbstab stability` and `rbstab run` write them.",
        )
    return files, others


def _refuse_others(path: Path) -> None:
    """Say what a file is that is not a proof of rest states, and how to get one of it."""
    kind = kind_of(path)
    if path.name.startswith(WITHIN_TOLERANCES):
        raise click.UsageError(
            f"{path} is a proof for all bodies, or for all starts, within tolerances; only proofs "
            "of rest states can be checked"
        )
    is_run = path.suffix == RESULT and is_file(path)
    if kind in (Kind.PROOF, Kind.BOUND) or (kind is Kind.RUN and not is_run):
        return
    what = "a result" if is_run else kind.words
    prove = f"Prove it: rbstab stability {shell_word(path)}. " if kind is Kind.CONFIG else ""
    raise click.UsageError(
        f"{path} is {what}, not a proof. {prove}Proofs are the files in DIR/proofs, by default "
        "results/proofs; `rbstab verify results` checks all of them"
    )


def _data(checked: Checked) -> dict[str, Any]:
    """Return the findings as data for JSON."""
    keys = ("about", "claim", "verified", "text", "boxes")
    return {
        "proof": str(checked.path),
        "id": checked.proof.id,
        "verified": checked.verification.verified,
        "too_long": checked.verification.takes_too_long,
        "findings": [
            {key: getattr(finding, key) for key in keys}
            for finding in checked.verification.findings
        ],
        "unchecked": checked.verification.unchecked,
    }


def _certificate(checked: Checked) -> dict[str, Any]:
    """Return all covers as data for JSON; docs/proofs.md describes them."""
    return {
        "id": checked.proof.id,
        "verified": checked.verification.verified,
        "covers": [
            {
                "about": finding.about,
                "claim": finding.claim,
                "place": place,
                "box": cover.box,
                "places": cover.places,
                "tree": " ".join(cover.tree),
            }
            for finding in checked.verification.findings
            for place, cover in finding.covers.items()
        ],
    }


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _boxes(count: int) -> str:
    return f" ({grouped(count)} boxes)" if count else ""


def _print(checked: Checked, *, alone: bool, several: bool) -> None:
    """Print all findings on a proof; of several, one verified or claiming nothing is a line."""
    verification = checked.verification
    # `several`: more than one file, or a folder, was named, and a summary follows.
    silent = several and checked.proof.claims_nothing
    outcome = f"claims nothing: {checked.proof.outcome}" if silent else verification.outcome
    click.echo(f"{checked.path}: {outcome}")
    if silent or (verification.verified and not alone):
        click.echo("\n" if silent else "", nl=False)
        return
    about = None
    for finding in verification.findings:
        if finding.about != about:
            about = finding.about
            click.echo(f"\n  {_upper(about)}")
        refused = "not decided" if verification.takes_too_long else "REFUSED"
        verdict = "checked" if finding.verified else refused
        end = f"{_boxes(finding.boxes)}. {finding.text}"
        click.echo(f"    {_upper(finding.claim)}: {verdict}{end}")
    _print_unchecked([checked])
    if several:
        click.echo()


def _print_claims(proofs: Sequence[Checked]) -> None:
    """Print how many claims of each kind were checked in verified proofs, and what was not."""
    claims, boxes = Counter[str](), Counter[str]()
    for finding in (finding for checked in proofs for finding in checked.verification.findings):
        # `region of rest state 2` is of the same kind as that of another rest state.
        kind = f"{finding.about}: {NUMBER.sub('N', finding.claim)}"
        claims[kind] += 1
        boxes[kind] += finding.boxes
    if claims:
        click.echo("\n  Checked")
    for kind, count in claims.items():
        click.echo(f"    {_upper(kind)}: {count}{_boxes(boxes[kind])}")
    _print_unchecked(proofs)
    click.echo()


def _print_unchecked(proofs: Sequence[Checked]) -> None:
    """Print what was not checked, and of how many proofs if not of all."""
    texts = Counter(text for checked in proofs for text in checked.verification.unchecked)
    if texts:
        click.echo("\n  Not checked")
    for text, count in texts.items():
        click.echo(f"    {text}" if count == len(proofs) else f"    {text} ({count} proofs)")
