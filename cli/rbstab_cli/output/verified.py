"""What `rbstab verify` prints: one proof in full, or of several the faults and counts."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab.files.counts import grouped

if TYPE_CHECKING:
    from rbstab.experiment.verification.verify import Verification

MAX_LISTED = 20
"""Of more proofs, those that are verified have no line each."""

_NUMBER = re.compile(r"\b\d+\b")


def print_verification(path: Path, found: "Verification") -> None:
    """Print all findings on a proof."""
    click.echo(f"{path}: {found.outcome}")
    about = None
    for finding in found.findings:
        if finding.about != about:
            about = finding.about
            click.echo(f"\n  {about[0].upper()}{about[1:]}")
        boxes = f" ({grouped(finding.boxes)} boxes)" if finding.boxes else ""
        refused = "not decided" if found.takes_too_long else "REFUSED"
        verdict = "checked" if finding.verified else refused
        claim = finding.claim[0].upper() + finding.claim[1:]
        click.echo(f"    {claim}: {verdict}{boxes}. {finding.text}")
    _print_unchecked(Counter(found.unchecked), 1)


def print_one_of(path: Path, found: "Verification", count: int) -> None:
    """Print one of several proofs: in full if it is refused, else a line.

    Args:
        path: Its file.
        found: What was found of it.
        count: How many proofs there are; of many, those that are verified have no line.
    """
    if not found.verified:
        print_verification(path, found)
        click.echo()
    elif count <= MAX_LISTED:
        click.echo(f"{path}: verified")


def print_counts(found: "Sequence[Verification]", nothing: Counter[str]) -> None:
    """Print how many claims of verified proofs were checked, and what was not.

    Args:
        found: What was found of the verified proofs.
        nothing: The reasons of files that claim nothing, with their numbers; a few of them were
            printed with the names of their files.
    """
    if found:
        _print_claims(found)
        _print_unchecked(Counter(text for one in found for text in one.unchecked), len(found))
    if nothing.total() and len(found) + nothing.total() > MAX_LISTED:
        click.echo("\n  Claims nothing")
        for reason, count in nothing.items():
            click.echo(f"    {reason} ({count} {'file' if count == 1 else 'files'})")
    click.echo()


def _print_claims(found: "Iterable[Verification]") -> None:
    """Print how many claims of each kind were checked."""
    claims, boxes = Counter[str](), Counter[str]()
    for one in found:
        for finding in one.findings:
            # `region of rest state 2` is of the same kind as that of another rest state.
            kind = f"{finding.about}: {_NUMBER.sub('N', finding.claim)}"
            claims[kind] += 1
            boxes[kind] += finding.boxes
    click.echo("\n  Checked")
    for kind, count in claims.items():
        examined = f" ({grouped(boxes[kind])} boxes)" if boxes[kind] else ""
        click.echo(f"    {kind[0].upper()}{kind[1:]}: {count}{examined}")


def _print_unchecked(texts: Counter[str], proofs: int) -> None:
    """Print what was not checked, and of how many proofs if not of all."""
    if not texts:
        return
    click.echo("\n  Not checked")
    for text, count in texts.items():
        click.echo(f"    {text}" if count == proofs else f"    {text} ({count} proofs)")
