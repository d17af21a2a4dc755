"""`rbstab verify`."""

from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import ALLOW_PYTHON, AS_JSON, CHANGES, QUIET, REPLACE_FILE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbstab.config.schema import Config
    from rbstab.experiment.stored_proof.proof import Proof
    from rbstab.experiment.verification.verify import Verification


@click.command("verify")
@click.argument(
    "proofs", metavar="PROOF...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option(
    "--config",
    "config_path",
    metavar="CONFIG",
    type=click.Path(path_type=Path),
    help="Also check that PROOF is the proof of this config.",
)
@CHANGES
@click.option(
    "--second",
    is_flag=True,
    help="Also ask codac, a solver of others, about the equations of CONFIG.",
)
@click.option(
    "--certificate",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write all boxes by which PROOF was checked, with their reasons, to FILE as JSON.",
)
@REPLACE_FILE
@ALLOW_PYTHON
@AS_JSON
@QUIET
def command(
    proofs: tuple[Path, ...],
    config_path: Path | None,
    changes: tuple[str, ...],
    second: bool,
    allow_python: bool,
    certificate: Path | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Check proofs by a program of its own.

    Each PROOF is a file of DIR/proofs, as `rbstab stability` writes it, or a folder of results DIR.
    Of a folder all proofs of rest states are checked, or with --config the newest proof of that
    config.

    Of several proofs, those that are refused are printed in full, and of the others how many claims
    of each kind were checked. A file that only says why there is no proof claims nothing, and is
    not counted.

    The rest states of a proof and the region of each minimum are checked. The checker shares no
    bounds and no arithmetic with the program that made the proof: it computes all of them anew, in
    balls of 128 bits. If a claim is wrong or cannot be confirmed, the exit code is 4. If no claim
    is refused, but a check takes too long (more than 3,000,000 evaluations of the energy), it is 5.

    With --second, codac confirms or refutes rest states and certified regions from the equations of
    CONFIG, in five minutes at most. If it refutes a claim, the exit code is 4. If it leaves one
    open, it is 5.
    """
    from rbstab.files.existence import is_dir
    from rbstab_cli.arguments.proofs import is_other_proof, proofs_of_folder
    from rbstab_cli.output.text_file import check_target

    if certificate is not None:
        check_target(certificate, force=force)
    config = _config(config_path, changes, allow_python=allow_python)
    if second:
        _check_second(config)
    several = len(proofs) > 1 or is_dir(proofs[0])
    if certificate is not None and several:
        raise click.UsageError("--certificate needs the file of one proof")
    files: list[Path] = []
    others = 0
    for given in dict.fromkeys(proofs):
        if is_dir(given):
            of_folder, left = proofs_of_folder(given, config)
            files += of_folder
            others += left
            continue
        if is_other_proof(given):
            raise click.UsageError(
                f"{given} is a proof for all bodies, or for all starts, within tolerances; only "
                "proofs of rest states can be checked"
            )
        _refuse_others(given)
        files.append(given)
    if several:
        where = f"{proofs[0]}: " if len(proofs) == 1 else ""
        _check_several(where, files, others, config, second=second, as_json=as_json, quiet=quiet)
        return
    (proof,) = files
    checked = _checked(proof, config, second=second, quiet=quiet)
    if checked is None:
        raise click.exceptions.Exit(exit_codes.STORAGE)
    stored, found = checked
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json(_data(proof, stored, found))
    else:
        from rbstab_cli.output.verified import print_verification

        print_verification(proof, found)
    if certificate is not None:
        from rbstab_cli.output.json_output import as_json_text
        from rbstab_cli.output.text_file import write_text

        write_text(certificate, as_json_text(_certificate(stored, found)) + "\n", force=force)
    _exit_unless_verified([found])


def _check_second(config: "Config | None") -> None:
    """Refuse to ask for a second opinion without a config, or without codac."""
    if config is None:
        raise click.UsageError("--second needs --config: codac is asked about its equations.")
    if find_spec("codac") is None:
        raise click.UsageError(
            "a second opinion needs codac, which a plain install lacks. "
            'Run `pip install "rbstab[second]"`'
        )


def _exit_unless_verified(found: "Sequence[Verification]") -> None:
    """End the command with the exit code of a proof that is refused, or takes too long."""
    left = [one for one in found if not one.verified]
    if left:
        all_late = all(one.takes_too_long for one in left)
        raise click.exceptions.Exit(exit_codes.TOO_LONG if all_late else exit_codes.STORAGE)


def _check_several(
    where: str,
    files: list[Path],
    others: int,
    config: "Config | None",
    *,
    second: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Check proofs one after the other; a damaged one does not stop the others."""
    from rbstab_cli.output.verified import (
        MAX_LISTED,
        print_counts,
        print_one_of,
        print_verification,
    )

    data, results = [], []
    nothing = Counter[str]()
    for path in files:
        checked = _checked(path, config, second=second, quiet=quiet)
        if checked is None:
            continue
        stored, found = checked
        if stored.claims_nothing:
            nothing[stored.outcome] += 1
            if not as_json and len(files) <= MAX_LISTED:
                click.echo(f"{path}: claims nothing: {stored.outcome}\n")
            continue
        data.append(_data(path, stored, found))
        results.append(found)
        if as_json:
            continue
        if len(files) == 1:
            print_verification(path, found)
            click.echo()
        else:
            print_one_of(path, found, len(files))
    empty = nothing.total()
    proofs, verified = len(files) - empty, sum(found.verified for found in results)
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json(data)
    else:
        if len(files) > 1:
            print_counts([found for found in results if found.verified], nothing)
        not_checked = f"; {others} within tolerances cannot be checked" if others else ""
        without = (
            f"; {empty} {'file claims' if empty == 1 else 'files claim'} nothing" if empty else ""
        )
        click.echo(f"{where}{verified} of {proofs} proofs verified{without}{not_checked}")
    _exit_unless_verified(results)
    if verified < proofs or not verified:
        raise click.exceptions.Exit(exit_codes.STORAGE)


def _checked(
    path: Path, config: "Config | None", *, second: bool, quiet: bool
) -> "tuple[Proof, Verification] | None":
    """Return a proof with what was found of it; print why it cannot be read, and return None."""
    from rbstab.experiment.stored_proof.proof import Proof
    from rbstab.experiment.verification.verify import verify
    from rbstab.store.document import read_model
    from rbstab.store.errors import StoreError
    from rbstab_cli.output.progress import claims_checked

    try:
        stored = read_model(path, Proof)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        return None
    with claims_checked(path.name, wanted=not quiet) as progress:
        return stored, verify(stored, config, progress, second=second)


def _refuse_others(path: Path) -> None:
    """Say what a file is that is not a proof, and how to get a proof of it."""
    from rbstab.files.existence import is_file
    from rbstab.files.shell_words import shell_word
    from rbstab.report.reading.not_results import CONFIG, PROOF, what_it_is

    what = "a result" if path.suffix == ".h5" and is_file(path) else what_it_is(path)
    if what in {None, PROOF}:
        return
    prove = f"Prove it: rbstab stability {shell_word(path)}. " if what == CONFIG else ""
    raise click.UsageError(
        f"{path} is {what}, not a proof. {prove}Proofs are the files in DIR/proofs, by default "
        "results/proofs; `rbstab verify results` checks all of them"
    )


def _config(path: Path | None, changes: tuple[str, ...], *, allow_python: bool) -> "Config | None":
    if path is None:
        if changes:
            raise click.UsageError("--set changes a config; give it with --config.")
        if allow_python:
            raise click.UsageError("--allow-python has no effect without --config.")
        return None
    # Without permission the config is only read: all but the energy of code can be compared.
    return load_all([path], changes, allow_python=allow_python or None)[path]


def _data(path: Path, proof: "Proof", found: "Verification") -> dict[str, Any]:
    """Return the findings as data for JSON."""
    return {
        "proof": str(path),
        "id": proof.id,
        "verified": found.verified,
        "too_long": found.takes_too_long,
        "findings": [
            {
                "about": finding.about,
                "claim": finding.claim,
                "verified": finding.verified,
                "text": finding.text,
                "boxes": finding.boxes,
            }
            for finding in found.findings
        ],
        "unchecked": found.unchecked,
    }


def _certificate(proof: "Proof", found: "Verification") -> dict[str, Any]:
    """Return all covers as data for JSON; docs/proofs.md describes them."""
    return {
        "id": proof.id,
        "verified": found.verified,
        "covers": [
            {
                "about": finding.about,
                "claim": finding.claim,
                "place": place,
                "box": cover.box,
                "places": cover.places,
                "tree": " ".join(cover.tree),
            }
            for finding in found.findings
            for place, cover in finding.covers.items()
        ],
    }
