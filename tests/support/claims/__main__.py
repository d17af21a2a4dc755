"""`python -m support.claims make|ask|compare [NAME ...]`."""

import json
import resource
import subprocess
import sys

import click

from support.claims import table
from support.claims.compare import gained, lost, lost_within
from support.claims.evidence import doubts
from support.claims.program import Claims, claims_of
from support.claims.tolerances import WITHIN, within

ASKED_LIMIT = 100
"""s, CPU time: the longest that a proof may take that was asked for."""

NAMES = click.argument("names", nargs=-1)


@click.group()
def main():
    """The table of claims; NAMES are parts of the names of configs, by default all."""


@main.command()
@NAMES
def make(names):
    """Write the claims of the present program about the configs; others are kept.

    The times of proofs are those of this machine; `ask` adds proofs that are asked for.
    """
    stored = table.read(table.TABLE) if table.TABLE.exists() else {}
    for name in table.names():
        if _is_meant(name, names) or name not in stored:
            claims = claims_of(table.config_of(name))
            stored[name] = claims | _more(name, claims)
            click.echo(f"{name}: {_summary(stored[name])}")
            # Written each time: this takes minutes.
            table.write(table.TABLE, {key: stored[key] for key in table.names() if key in stored})


def _more(name, claims):
    """Return the doubts about claims, and what is proved within tolerances."""
    more: Claims = {"doubts": doubts(table.config_of(name), claims)}
    if name in WITHIN:
        more["within"] = within(name)
    return more


@main.command()
@NAMES
def ask(names):
    """Add the claims of proofs that are asked for, where those that are unasked ended early."""
    stored = table.read(table.TABLE)
    for name, claims in stored.items():
        if claims["brief"] and _is_meant(name, names):
            claims["asked"] = _asked(name)
            click.echo(f"{name}: {claims['asked'] and _outcome(claims['asked'])}")
            table.write(table.TABLE, stored)


@main.command(hidden=True)
@click.argument("name")
def asked(name):
    """Print the claims of a proof that is asked for, as JSON; end early if it takes too long."""
    resource.setrlimit(resource.RLIMIT_CPU, (ASKED_LIMIT, ASKED_LIMIT))
    click.echo(json.dumps(claims_of(table.config_of(name), asked=True)))


def _asked(name):
    """Return the claims of a proof that is asked for; None if it takes too long."""
    command = [sys.executable, "-m", "support.claims", "asked", name]
    ended = subprocess.run(command, capture_output=True, check=False)
    if ended.returncode:
        return None
    claims: Claims = json.loads(ended.stdout)
    return claims


@main.command()
@NAMES
def compare(names):
    """Say which claims the program makes no more, and which are new; exit 1 if any is lost."""
    failed = False
    for name, before in table.read(table.TABLE).items():
        if not _is_meant(name, names):
            continue
        now = claims_of(table.config_of(name))
        missing, new = lost(before, now), gained(before, now)
        if name in WITHIN:
            missing += lost_within(before["within"], within(name))
        failed |= bool(missing)
        old, seconds = before["seconds"], now["seconds"]
        click.echo(f"{name}: {old['rest']:.1f} -> {seconds['rest']:.1f} s")
        for text in missing:
            click.echo(f"  LOST {text}")
        for text in new:
            click.echo(f"  new  {text}")
    raise SystemExit(1 if failed else 0)


def _is_meant(name, names):
    return not names or any(part in name for part in names)


def _outcome(claims):
    if not claims["passive"]:
        return f"no proof: {claims['why_not'].partition(';')[0]}"
    part = claims["range"]
    if not part["complete"]:
        return "not complete"
    kept = "every start" if claims["every_start"] else "complete"
    return f"{kept}, {len(part['states'])} states"


def _summary(claims):
    spent = claims["seconds"]["rest"]
    doubted = "".join(f"; DOUBT {key}: {text}" for key, text in claims["doubts"].items())
    return f"{_outcome(claims)}, {claims['range']['boxes']} boxes, {spent} s{doubted}"


if __name__ == "__main__":
    main()
