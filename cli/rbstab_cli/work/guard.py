"""`rbstab guard`: a guard of θ2 with which motions are proved to keep the range."""

import math
from pathlib import Path
from typing import Any

import click

from rbstab.config.load import resolved_yaml
from rbstab.experiment.answers.rounded import number
from rbstab.experiment.summary import at_least
from rbstab.experiment.tuning.guard import ANY_ANGLES, SOFT_ANGLE, Guarded, RunOutcome
from rbstab.experiment.tuning.guard import guard as guarded
from rbstab_cli import exit_codes
from rbstab_cli.inputs import load_single_config
from rbstab_cli.output.files import new_config, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import Table, print_json, say

BARRIER = "barrier"

STRENGTHS = {
    BARRIER: "barrier k [N m]",
    "stiff": "stiffness k [N m/rad]",
    "repelling": "couple K [N m]",
}


def guard(
    config: Path,
    method: str,
    soft_angle: float | None,
    limit: float | None,
    output: Path | None,
    changes: tuple[str, ...],
    allow_python: bool,
    force: bool,
    as_json: bool,
) -> int:
    """Search for a guard, print what it changes in the run, and write the config with it.

    Args:
        config: The file of the config.
        method: The kind of guard, a key of `STRENGTHS`.
        soft_angle: |θ2| from which a soft guard acts, rad; None: the default.
        limit: The largest couple that a soft guard may have in the run, N m; None: any.
        output: The file of the new config; None: it is named after the config.
        changes: Texts `key=value` that replace single values of the config.
        allow_python: Whether the files of users' elements may be run.
        force: Whether an existing file is replaced.
        as_json: Whether to print JSON.
    """
    _check_options(method, soft_angle, limit)
    target = new_config(config, output, "_guarded", force=force)
    loaded = load_single_config(config, changes, allow_python=allow_python)
    angle = SOFT_ANGLE if soft_angle is None else soft_angle
    with working(f"{config.name}: guard") as work:

        def tried(stiffness: float, outcome: str) -> None:
            work.hint(f"k = {stiffness:g} N m: {outcome}")

        design = guarded(loaded, method, angle, limit, tried)
    accepted = design.config is not None and design.limit_kept is not False
    if design.config is not None and accepted:
        write_file(target, resolved_yaml(design.config), force=force)
    if as_json:
        file = str(target) if accepted else None
        print_json({"file": file, "method": method, **_data(design, method, angle, limit)})
    else:
        _print(design, method, limit)
    if design.strength == 0:
        say(f"{config}: keeps the range without a guard: proved; nothing is written")
    elif not accepted:
        say(f"{config}: {_why_none(design, method, limit)}; nothing is written")
        return exit_codes.NOT_COMPLETED
    elif design.kept is None:
        say(f"{config}: every start in the range converges: proved -> {target}")
    else:
        say(f"{config}: this start keeps the range: proved -> {target}")
        say(f"{config}: convergence {design.kept.convergence}")
    return exit_codes.OK


def _check_options(method: str, soft_angle: float | None, limit: float | None) -> None:
    given = {"--soft-angle": soft_angle, "--limit": limit}
    unused = [name for name, value in given.items() if value is not None]
    if method == BARRIER and unused:
        raise click.UsageError(f"--method barrier has no use for {', '.join(unused)}")
    if soft_angle is not None and not 0 < soft_angle < math.pi / 2:
        raise click.UsageError(f"--soft-angle is {soft_angle:g} (expected between 0 and π/2 rad)")
    if limit is not None and not 0 < limit < math.inf:
        raise click.UsageError(f"--limit is {limit:g} (expected a couple above 0, N m)")


def _exceeds(design: Guarded, limit: float | None) -> bool:
    """Whether the couple is larger than the limit in the run itself."""
    return (
        design.guarded is not None and limit is not None and design.guarded.largest_couple > limit
    )


def _why_none(design: Guarded, method: str, limit: float | None) -> str:
    """Return why nothing is written."""
    if design.config is not None and (design.guarded is None or _exceeds(design, limit)):
        return f"the couple exceeds the limit of {limit:g} N m in the run"
    if design.config is not None:
        return (
            f"the samples do not show the largest |θ2|, so the couple may exceed the limit of "
            f"{limit:g} N m between them; raise integration.samples"
        )
    if method != BARRIER:
        return f"no guard was found: {design.reason}"
    if design.tried and ANY_ANGLES in design.tried[-1][1]:
        return (
            f"no barrier was found. Every start can converge to one rest state only if there is no "
            f"other {ANY_ANGLES}; a barrier keeps only θ2. For this start alone: --method stiff"
        )
    return "no barrier was found"


def _print(design: Guarded, method: str, limit: float | None) -> None:
    """Print the run of the given config beside that with the guard, and what is proved."""
    numbers = ("given", "guarded")
    table = Table("quantity", *numbers, numbers=numbers)
    strength = "none was found" if design.strength is None else number(design.strength)
    table.add(STRENGTHS[method], "-", strength)
    given = _facts(design.given)
    other = dict.fromkeys(given, "-") if design.guarded is None else _facts(design.guarded)
    for name, text in given.items():
        table.add(name, text, other[name])
    for name, text in _proved(design, limit).items():
        table.add(name, "-", text)
    table.print()


def _facts(outcome: RunOutcome) -> dict[str, str]:
    """Return a run as texts by their labels."""

    def peak(value: float) -> str:
        # A guard without a couple in this run has none between the samples either, as far as known.
        return at_least(outcome.pitch_resolved or value == 0) + number(value)

    settling = outcome.settling_time
    return {
        "status": str(outcome.status),
        "largest |θ2| [rad]": peak(outcome.largest_pitch),
        "v below v(0)/1000 from [s]": (
            "not in this run" if math.isnan(settling) else number(settling)
        ),
        "largest couple of the guard [N m]": peak(outcome.largest_couple),
    }


def _proved(design: Guarded, limit: float | None) -> dict[str, str]:
    """Return what is proved with a soft guard, by labels."""
    if design.kept is None or design.couple_bound is None:
        return {}
    rows = {
        "energy at the start [J]": number(design.kept.energy),
        "keeps the range below, proved [J]": number(design.kept.energy_bound),
        "couple in any such motion at most [N m]": number(design.couple_bound),
    }
    if limit is None:
        return rows
    word = "in this run" if design.limit_kept else "not known"
    if design.couple_bound <= limit:
        word = "proved"
    if _exceeds(design, limit):
        word = "no"
    return rows | {f"couple stays below {limit:g} N m": word}


def _data(design: Guarded, method: str, soft_angle: float, limit: float | None) -> dict[str, Any]:
    """Return what was found, as plain data."""
    runs = {
        "given": design.given._asdict(),
        "guarded": None if design.guarded is None else design.guarded._asdict(),
    }
    if method == BARRIER:
        tried = [{"stiffness": k, "outcome": outcome} for k, outcome in design.tried]
        return {"stiffness": design.strength, "tried": tried, **runs}
    kept, proved = design.kept, None
    if kept is not None:
        proved = {
            "keeps_range": True,
            "energy": kept.energy,
            "energy_bound": kept.energy_bound,
            "couple_bound": design.couple_bound,
            "converges": bool(kept.states),
            "rest_orientations": [state.orientation for state in kept.states],
        }
    return {
        "soft_angle": soft_angle,
        "couple" if method == "repelling" else "stiffness": design.strength,
        "proved": proved,
        "reason": design.reason or (kept.reason if kept is not None else ""),
        "limit": limit,
        "below_limit": design.limit_kept,
        **runs,
    }
