"""`rbstab verify`: proofs checked by a program of its own."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import click

from rbstab.config.schema import Config
from rbstab.experiment.proof_cache import PROOFS, WITHIN_TOLERANCES, proof_file
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.verification.verify import Verification
from rbstab.experiment.verification.verify import verify as verified
from rbstab.files.counts import grouped
from rbstab.files.existence import is_dir, is_file
from rbstab.files.shell_words import shell_word
from rbstab.proof.check.findings import Finding
from rbstab.report.reading.not_results import CONFIG, PROOF, what_it_is
from rbstab.store.disk.paths import not_done
from rbstab.store.document import read_model
from rbstab.store.errors import StoreError
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed
from rbstab_cli.inputs import load_configs
from rbstab_cli.output.files import check_target, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import as_json_text, print_json, say

NUMBER = re.compile(r"\b\d+\b")


class Checked(NamedTuple):
    """A proof, the file it is in, and what was found of it."""

    path: Path
    proof: Proof
    found: Verification


def verify(
    proofs: tuple[Path, ...],
    config_path: Path | None,
    changes: tuple[str, ...],
    second: bool,
    certificate: Path | None,
    force: bool,
    allow_python: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Check proofs and print what was found."""
    if certificate is not None:
        check_target(certificate, force=force)
    config = _config(config_path, changes, allow_python=allow_python)
    if second and find_spec("codac") is None:
        raise click.UsageError(
            "a second opinion needs codac, which a plain install lacks. "
            'Run `pip install "rbstab[second]"`'
        )
    several = len(proofs) > 1 or is_dir(proofs[0])
    if certificate is not None and several:
        raise click.UsageError("--certificate needs the file of one proof")
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
    # A damaged proof among several does not stop the others.
    tried = (_checked(path, config, second=second, quiet=quiet) for path in files)
    checked = (one for one in tried if one is not None)
    if not several:
        return _tell_one(checked, certificate, force=force, as_json=as_json)
    where = f"{proofs[0]}: " if len(proofs) == 1 else ""
    return _tell_all(where, len(files), checked, others, as_json=as_json)


def _checked(path: Path, config: Config | None, *, second: bool, quiet: bool) -> Checked | None:
    """Return a proof with what was found of it; print why it cannot be read, and return None."""
    try:
        proof = read_model(path, Proof)
    except StoreError as error:
        say(f"error: {error}")
        return None
    count = 0
    with working(path.name, quiet=quiet) as work:

        def progress(finding: Finding) -> None:
            nonlocal count
            count += 1
            work.update(f"{count} claims checked, last: {finding.claim}")

        return Checked(path, proof, verified(proof, config, progress, second=second))


def _tell_one(
    checked: Iterable[Checked], certificate: Path | None, *, force: bool, as_json: bool
) -> int:
    """Print what was found of the only proof, and write its certificate."""
    for one in checked:
        if as_json:
            print_json(_data(one))
        else:
            _print(one)
        if certificate is not None:
            write_file(certificate, as_json_text(_certificate(one)) + "\n", force=force)
        return _code([one])
    return exit_codes.STORAGE


def _tell_all(
    where: str, files: int, checked: Iterable[Checked], others: int, *, as_json: bool
) -> int:
    """Print what was found of several proofs: those that are refused in full, then counts."""
    claiming: list[Checked] = []
    silent: list[Checked] = []
    for one in checked:
        (silent if one.proof.claims_nothing else claiming).append(one)
        if not as_json:
            _print_one_of(one, files)
    proofs, good = files - len(silent), [one for one in claiming if one.found.verified]
    if as_json:
        print_json([_data(one) for one in claiming])
    else:
        if files > 1:
            if good:
                _print_claims(finding for one in good for finding in one.found.findings)
                unchecked = Counter(text for one in good for text in one.found.unchecked)
                _print_unchecked(unchecked, len(good))
            click.echo()
        ends = [f"{len(good)} of {proofs} proofs verified"]
        if silent:
            claim = "file claims" if len(silent) == 1 else "files claim"
            ends.append(f"{len(silent)} {claim} nothing")
        if others:
            ends.append(f"{others} within tolerances cannot be checked")
        click.echo(where + "; ".join(ends))
    code = _code(claiming)
    if code == exit_codes.OK and not 0 < len(good) == proofs:
        return exit_codes.STORAGE
    return code


def _code(checked: Sequence[Checked]) -> int:
    """Return the exit code: whether a proof is refused, or else takes too long."""
    left = [one.found for one in checked if not one.found.verified]
    if not left:
        return exit_codes.OK
    all_late = all(found.takes_too_long for found in left)
    return exit_codes.TOO_LONG if all_late else exit_codes.STORAGE


def _config(path: Path | None, changes: tuple[str, ...], *, allow_python: bool) -> Config | None:
    if path is None:
        return None
    # Without permission the config is only read: all but the energy of code can be compared.
    return load_configs([path], changes, allow_python=allow_python or None)[path]


def _proofs_of_folder(folder: Path, config: Config | None) -> tuple[list[Path], int]:
    """Return the proofs of rest states in a folder of results, or in its folder of proofs.

    Args:
        folder: The folder.
        config: Only the proof of this config is returned; None: all proofs.

    Returns:
        The files, at least one, and how many proofs within tolerances are beside them.

    Raises:
        Failed: There is none.
        StoreError: The folder cannot be read.
    """
    place = folder if folder.absolute().name == PROOFS else folder / PROOFS
    try:
        found = sorted(path for path in place.iterdir() if path.suffix == ".json")
    except (FileNotFoundError, NotADirectoryError):
        found = []
    except OSError as error:
        raise not_done(place, "read", error) from error
    files = [path for path in found if not path.name.startswith(WITHIN_TOLERANCES)]
    others = len(found) - len(files)
    if config is not None:
        name = proof_file(folder, config).name
        files = [path for path in files if path.name == name]
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
    if path.name.startswith(WITHIN_TOLERANCES):
        raise click.UsageError(
            f"{path} is a proof for all bodies, or for all starts, within tolerances; only proofs "
            "of rest states can be checked"
        )
    what = "a result" if path.suffix == ".h5" and is_file(path) else what_it_is(path)
    if what in {None, PROOF}:
        return
    prove = f"Prove it: rbstab stability {shell_word(path)}. " if what == CONFIG else ""
    raise click.UsageError(
        f"{path} is {what}, not a proof. {prove}Proofs are the files in DIR/proofs, by default "
        "results/proofs; `rbstab verify results` checks all of them"
    )


def _data(one: Checked) -> dict[str, Any]:
    """Return the findings as data for JSON."""
    keys = ("about", "claim", "verified", "text", "boxes")
    return {
        "proof": str(one.path),
        "id": one.proof.id,
        "verified": one.found.verified,
        "too_long": one.found.takes_too_long,
        "findings": [
            {key: getattr(finding, key) for key in keys} for finding in one.found.findings
        ],
        "unchecked": one.found.unchecked,
    }


def _certificate(one: Checked) -> dict[str, Any]:
    """Return all covers as data for JSON; docs/proofs.md describes them."""
    return {
        "id": one.proof.id,
        "verified": one.found.verified,
        "covers": [
            {
                "about": finding.about,
                "claim": finding.claim,
                "place": place,
                "box": cover.box,
                "places": cover.places,
                "tree": " ".join(cover.tree),
            }
            for finding in one.found.findings
            for place, cover in finding.covers.items()
        ],
    }


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _boxes(count: int) -> str:
    return f" ({grouped(count)} boxes)" if count else ""


def _print(one: Checked) -> None:
    """Print all findings on a proof."""
    found = one.found
    click.echo(f"{one.path}: {found.outcome}")
    about = None
    for finding in found.findings:
        if finding.about != about:
            about = finding.about
            click.echo(f"\n  {_upper(about)}")
        refused = "not decided" if found.takes_too_long else "REFUSED"
        verdict = "checked" if finding.verified else refused
        end = f"{_boxes(finding.boxes)}. {finding.text}"
        click.echo(f"    {_upper(finding.claim)}: {verdict}{end}")
    _print_unchecked(Counter(found.unchecked), 1)


def _print_one_of(one: Checked, files: int) -> None:
    """Print one of several proofs: in full if it is refused or alone, else a line.

    Args:
        one: The proof.
        files: How many proofs there are.
    """
    if one.proof.claims_nothing:
        click.echo(f"{one.path}: claims nothing: {one.proof.outcome}\n")
    elif not one.found.verified or files == 1:
        _print(one)
        click.echo()
    else:
        click.echo(f"{one.path}: verified")


def _print_claims(findings: Iterable[Finding]) -> None:
    """Print how many claims of each kind were checked."""
    claims, boxes = Counter[str](), Counter[str]()
    for finding in findings:
        # `region of rest state 2` is of the same kind as that of another rest state.
        kind = f"{finding.about}: {NUMBER.sub('N', finding.claim)}"
        claims[kind] += 1
        boxes[kind] += finding.boxes
    click.echo("\n  Checked")
    for kind, count in claims.items():
        click.echo(f"    {_upper(kind)}: {count}{_boxes(boxes[kind])}")


def _print_unchecked(texts: Counter[str], proofs: int) -> None:
    """Print what was not checked, and of how many proofs if not of all."""
    if not texts:
        return
    click.echo("\n  Not checked")
    for text, count in texts.items():
        click.echo(f"    {text}" if count == proofs else f"    {text} ({count} proofs)")
