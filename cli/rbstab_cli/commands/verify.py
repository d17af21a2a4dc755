"""`rbstab verify`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import AS_JSON, CHANGES, QUIET, REPLACE_FILE

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.proof import Proof
    from rbstab.experiment.verification.verify import Verification


OTHER_PROOFS = ("within-", "starts-")
"""The beginnings of the names of proofs within tolerances."""


@click.command("verify")
@click.argument("proof", metavar="PROOF", type=click.Path(path_type=Path))
@click.option(
    "--config",
    "config_path",
    metavar="CONFIG",
    type=click.Path(path_type=Path),
    help="Also check that PROOF is the proof of this config.",
)
@CHANGES
@click.option(
    "--certificate",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write all boxes by which PROOF was checked, with their reasons, to FILE as JSON.",
)
@REPLACE_FILE
@AS_JSON
@QUIET
def command(
    proof: Path,
    config_path: Path | None,
    changes: tuple[str, ...],
    certificate: Path | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Check a proof by a program of its own.

    PROOF is a file of DIR/proofs, as `rbstab stability` writes it. Its rest states and the region
    of each minimum are checked. The checker shares no bounds and no arithmetic with the program
    that made the proof: it computes all of them anew, in balls of 128 bits. If a claim is wrong or
    cannot be confirmed, the exit code is 4.
    """
    from rbstab.experiment.proof import Proof
    from rbstab.experiment.verification.verify import verify
    from rbstab.store.document import read_model
    from rbstab.store.errors import StoreError
    from rbstab_cli.output.progress import claims_checked
    from rbstab_cli.output.text_file import check_target, write_text

    if changes and config_path is None:
        raise click.UsageError("--set changes a config; give it with --config.")
    if certificate is not None:
        check_target(certificate, force=force)
    config = None if config_path is None else _config(config_path, changes)
    if proof.name.startswith(OTHER_PROOFS):
        raise click.UsageError(
            f"{proof} is a proof for all bodies, or for all starts, within tolerances; only proofs "
            "of rest states can be checked"
        )
    _refuse_others(proof)
    try:
        stored = read_model(proof, Proof)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    with claims_checked(proof.name, wanted=not quiet) as progress:
        found = verify(stored, config, progress)
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json(_data(proof, stored, found))
    else:
        _print(proof, found)
    if certificate is not None:
        from rbstab_cli.output.json_output import as_json_text

        write_text(certificate, as_json_text(_certificate(stored, found)) + "\n", force=force)
    if not found.verified:
        raise click.exceptions.Exit(exit_codes.STORAGE)


def _refuse_others(path: Path) -> None:
    """Say what a file is that is not a proof, and how to get a proof of it."""
    from rbstab.files.shell_words import shell_word
    from rbstab.report.reading.not_results import CONFIG, PROOF, what_it_is

    what = "a result" if path.suffix == ".h5" and path.is_file() else what_it_is(path)
    if what in {None, PROOF}:
        return
    prove = f"Prove it: rbstab stability {shell_word(path)}. " if what == CONFIG else ""
    raise click.UsageError(
        f"{path} is {what}, not a proof. {prove}Proofs are the files in DIR/proofs, by default "
        "results/proofs"
    )


def _config(path: Path, changes: tuple[str, ...]) -> "Config":
    # No proof evaluates the code of a user, so none needs to run.
    return load_all([path], changes, allow_python=None)[path]


def _print(path: Path, found: "Verification") -> None:
    click.echo(f"{path}: {'verified' if found.verified else 'REFUSED'}")
    about = None
    for finding in found.findings:
        if finding.about != about:
            about = finding.about
            click.echo(f"\n  {about[0].upper()}{about[1:]}")
        boxes = f" ({finding.boxes:,} boxes)" if finding.boxes else ""
        verdict = "checked" if finding.verified else "REFUSED"
        claim = finding.claim[0].upper() + finding.claim[1:]
        click.echo(f"    {claim}: {verdict}{boxes}. {finding.text}")
    if found.unchecked:
        click.echo("\n  Not checked")
        for text in found.unchecked:
            click.echo(f"    {text}")


def _data(path: Path, proof: "Proof", found: "Verification") -> dict[str, Any]:
    """Return the findings as data for JSON."""
    return {
        "proof": str(path),
        "id": proof.id,
        "verified": found.verified,
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
