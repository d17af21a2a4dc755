"""`python -m support.claims make|compare|times [NAME ...]`."""

import statistics
from collections import Counter

import click

from support.claims import table
from support.claims.bodies import bodies
from support.claims.compare import gained, lost
from support.claims.evidence import doubts
from support.claims.program import claims_of

NAMES = click.argument("names", nargs=-1)


@click.group()
def main() -> None:
    """The table of claims; NAMES are parts of the names of configs, by default all."""


@main.command()
@NAMES
def make(names: tuple[str, ...]) -> None:
    """Write the configs and the claims of the present program about them; others are kept."""
    table.write(table.BODIES, bodies())
    stored = table.read(table.TABLE) if table.TABLE.exists() else {}
    for name in table.names():
        if not (_is_meant(name, names) or name not in stored):
            continue
        config = table.config_of(name)
        claims = claims_of(config)
        claims["doubts"] = doubts(config, claims)
        stored[name] = claims
        click.echo(f"{name}: {_summary(claims)}")
        # Written each time: this takes minutes.
        table.write(table.TABLE, {one: stored[one] for one in table.names() if one in stored})


@main.command()
@NAMES
def compare(names: tuple[str, ...]) -> None:
    """Say which claims the program makes no more, and which are new; exit 1 if any is lost."""
    failed = False
    for name, before in table.read(table.TABLE).items():
        if not _is_meant(name, names):
            continue
        now = claims_of(table.config_of(name))
        missing, new = lost(before, now), gained(before, now)
        failed |= bool(missing)
        old, seconds = before["seconds"], now["seconds"]
        click.echo(f"{name}: {old['rest']:.1f} -> {seconds['rest']:.1f} s")
        for text in missing:
            click.echo(f"  LOST {text}")
        for text in new:
            click.echo(f"  new  {text}")
    raise SystemExit(1 if failed else 0)


@main.command()
def times() -> None:
    """Print the counts of the table, and the CPU times of its proofs, the longest first."""
    stored = table.read(table.TABLE)
    for kind, count in sorted(Counter(_outcome(one) for one in stored.values()).items()):
        click.echo(f"{count:4d} {kind}")
    for part in ("rest", "start"):
        seconds = {name: one["seconds"][part] for name, one in stored.items()}
        of_proofs = [seconds[name] for name, one in stored.items() if one["passive"]]
        click.echo(
            f"{part}: median {statistics.median(of_proofs):.2f} s, max {max(of_proofs):.2f} s, "
            f"sum {sum(of_proofs):.0f} s, of {len(of_proofs)} proofs"
        )
    for name, one in sorted(stored.items(), key=lambda item: -item[1]["seconds"]["rest"]):
        spent, boxes = one["seconds"], one["range"]["boxes"]
        click.echo(f"{spent['rest']:7.2f} s {spent['start']:7.2f} s {boxes:8d} boxes  {name}")


def _is_meant(name: str, names: tuple[str, ...]) -> bool:
    return not names or any(part in name for part in names)


def _outcome(claims: table.Claims) -> str:
    if not claims["passive"]:
        return f"no proof: {claims['why_not'].partition(';')[0]}"
    part = claims["range"]
    if not part["complete"]:
        return "not complete"
    kept = "every start" if claims["every_start"] else "complete"
    return f"{kept}, {len(part['states'])} states"


def _summary(claims: table.Claims) -> str:
    spent = claims["seconds"]["rest"]
    doubted = "".join(f"; DOUBT {key}: {text}" for key, text in claims["doubts"].items())
    return f"{_outcome(claims)}, {claims['range']['boxes']} boxes, {spent} s{doubted}"


if __name__ == "__main__":
    main()
