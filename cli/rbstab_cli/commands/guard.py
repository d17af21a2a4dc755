"""`rbstab guard`."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.choice import Choice
from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import (
    ALLOW_PYTHON,
    AS_JSON,
    CHANGES,
    QUIET,
    REPLACE_FILE,
    output_file,
)

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.tuning.guard import Guarded

BARRIER = "barrier"
STRENGTHS = {
    BARRIER: "barrier k [N m]",
    "stiff": "stiffness k [N m/rad]",
    "repelling": "couple K [N m]",
}


@click.command("guard")
@click.argument("config", metavar="CONFIG", type=click.Path(path_type=Path))
@click.option(
    "--method",
    type=Choice(list(STRENGTHS)),
    default=BARRIER,
    show_default=True,
    help="barrier: for every start. stiff, repelling: a force beyond a soft angle, for this start.",
)
@click.option(
    "--soft-angle",
    metavar="RAD",
    type=float,
    help="|θ2| from which a soft guard acts, rad.  [default: 1.2]",
)
@click.option(
    "--limit",
    metavar="N_M",
    type=float,
    help="Largest couple, N m, that a soft guard may have in the run.",
)
@output_file("File of the new config; CONFIG.yaml gives CONFIG_guarded.yaml in the working folder.")
@CHANGES
@ALLOW_PYTHON
@REPLACE_FILE
@AS_JSON
@QUIET
def command(
    config: Path,
    method: str,
    soft_angle: float | None,
    limit: float | None,
    output: Path | None,
    changes: tuple[str, ...],
    allow_python: bool,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Find a guard of θ2 with which motions are proved to keep the range.

    A barrier adds the energy ½ k tan² θ2. Stiffnesses k from 0.01 to 50,000 N m are tried until
    every start is proved to converge and the run of the config stays in the range. Then some
    smaller ones are tried.

    A soft guard adds ½ k (|θ2| - θ_s)² (stiff) or K (|θ2| - θ_s) (repelling) beyond a soft angle.
    The least k or K, of three digits, is found with which this start is proved to keep the range.

    Shows what the guard changes in the run, and writes the config with it; such a guard in the
    given config is replaced. If none is found, or its couple exceeds the limit, nothing is written,
    and the exit code is 3.
    """
    from rbstab_cli.motion_errors import motion_errors
    from rbstab_cli.output.progress import working
    from rbstab_cli.output.text_file import check_target

    _check_options(method, soft_angle, limit)
    target = output or Path(f"{config.stem}_guarded.yaml")
    if target.resolve() == config.resolve():
        raise click.UsageError(f"{target} is the given config. Choose another file with -o.")
    check_target(target, force=force)
    ((path, loaded),) = load_all([config], changes, allow_python=allow_python).items()
    with motion_errors(path), working(f"{path.name}: guard", wanted=not quiet) as work:
        from rbstab.experiment.tuning.guard import SOFT_ANGLE, guard

        def tried(stiffness: float, outcome: str) -> None:
            if not quiet:
                work.print(f"k = {stiffness:g} N m: {outcome}")

        angle = SOFT_ANGLE if soft_angle is None else soft_angle
        found = guard(loaded, method, angle, limit, tried)
    accepted = found.config is not None and found.limit_kept is not False
    _write(found.config if accepted else None, target, force=force)
    if as_json:
        from rbstab_cli.output.json_output import print_json

        file = str(target) if accepted else None
        print_json({"file": file, "method": method, **_data(found, method, angle, limit)})
    else:
        from rbstab_cli.output.guarded import print_runs

        strength = (STRENGTHS[method], found.strength)
        print_runs(strength, found.given, found.guarded, _soft_facts(found, limit))
    if found.strength == 0:
        click.echo(f"{path}: keeps the range without a guard: proved; nothing is written", err=True)
    elif not accepted:
        reason = _why_none(found, method, limit)
        click.echo(f"{path}: {reason}; nothing is written", err=True)
        raise click.exceptions.Exit(exit_codes.NOT_COMPLETED)
    elif found.kept is None:
        click.echo(f"{path}: every start in the range converges: proved -> {target}", err=True)
    else:
        click.echo(f"{path}: this start keeps the range: proved -> {target}", err=True)
        click.echo(f"{path}: convergence {found.kept.convergence}", err=True)


def _check_options(method: str, soft_angle: float | None, limit: float | None) -> None:
    given = {"--soft-angle": soft_angle, "--limit": limit}
    unused = [name for name, value in given.items() if value is not None]
    if method == BARRIER and unused:
        raise click.UsageError(f"--method barrier has no use for {', '.join(unused)}")
    if soft_angle is not None and not 0 < soft_angle < math.pi / 2:
        raise click.UsageError(f"--soft-angle is {soft_angle:g} (expected between 0 and π/2 rad)")
    if limit is not None and not 0 < limit < math.inf:
        raise click.UsageError(f"--limit is {limit:g} (expected a couple above 0, N m)")


def _why_none(found: "Guarded", method: str, limit: float | None) -> str:
    """Return why nothing is written."""
    if found.config is not None:
        return _excess(found, limit)
    if method != BARRIER:
        return f"no guard was found: {found.reason}"
    from rbstab.experiment.tuning.guard import ANY_ANGLES

    if found.tried and ANY_ANGLES in found.tried[-1][1]:
        return (
            f"no barrier was found. Every start can converge to one rest state only if there is no "
            f"other {ANY_ANGLES}; a barrier keeps only θ2. For this start alone: --method stiff"
        )
    return "no barrier was found"


def _excess(found: "Guarded", limit: float | None) -> str:
    """Return why a couple is not known to stay below the limit."""
    if found.guarded is None or limit is None or found.guarded.largest_couple > limit:
        return f"the couple exceeds the limit of {limit:g} N m in the run"
    return (
        f"the samples do not show the largest |θ2|, so the couple may exceed the limit of "
        f"{limit:g} N m between them; raise integration.samples"
    )


def _soft_facts(found: "Guarded", limit: float | None) -> tuple[tuple[str, str], ...]:
    """Return rows on what is proved with a soft guard."""
    from rbstab_cli.output.tables import number

    if found.kept is None or found.couple_bound is None:
        return ()
    rows = [
        ("energy at the start [J]", number(found.kept.energy)),
        ("keeps the range below, proved [J]", number(found.kept.energy_bound)),
        ("couple in any such motion at most [N m]", number(found.couple_bound)),
    ]
    if limit is not None:
        kept = found.couple_bound <= limit
        word = "proved" if kept else "in this run" if found.limit_kept else "not known"
        if found.guarded is not None and found.guarded.largest_couple > limit:
            word = "no"
        rows.append((f"couple stays below {limit:g} N m", word))
    return tuple(rows)


def _data(found: "Guarded", method: str, soft_angle: float, limit: float | None) -> dict[str, Any]:
    """Return what was found, as plain data."""
    runs = {
        "given": found.given._asdict(),
        "guarded": None if found.guarded is None else found.guarded._asdict(),
    }
    if method == BARRIER:
        tried = [{"stiffness": k, "outcome": outcome} for k, outcome in found.tried]
        return {"stiffness": found.strength, "tried": tried, **runs}
    kept, proved = found.kept, None
    if kept is not None:
        proved = {
            "keeps_range": True,
            "energy": kept.energy,
            "energy_bound": kept.energy_bound,
            "couple_bound": found.couple_bound,
            "converges": bool(kept.states),
            "rest_orientations": [state.orientation for state in kept.states],
        }
    return {
        "soft_angle": soft_angle,
        "couple" if method == "repelling" else "stiffness": found.strength,
        "proved": proved,
        "reason": found.reason or (kept.reason if kept is not None else ""),
        "limit": limit,
        "below_limit": found.limit_kept,
        **runs,
    }


def _write(config: "Config | None", target: Path, *, force: bool) -> None:
    if config is not None:
        from rbstab.config.load import resolved_yaml
        from rbstab_cli.output.text_file import write_text

        write_text(target, resolved_yaml(config), force=force)
