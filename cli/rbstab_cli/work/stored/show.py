"""`rbstab show`: what is in the file of a run; of other files see `other`."""

from pathlib import Path
from typing import Any, NamedTuple

import click

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.experiment.answers.assessed_run import AssessedRun
from rbstab.experiment.answers.facts import FACTS
from rbstab.experiment.answers.rest_modes import rest_modes
from rbstab.experiment.answers.rounded import number, vector
from rbstab.experiment.answers.words import run_words
from rbstab.experiment.convergence.convergence import ATTRIBUTE
from rbstab.experiment.stored_run import final_state, stored_config
from rbstab.experiment.summary import UNKNOWN_STEPS, ReferenceValue, reference_values_of
from rbstab.files.text import printable
from rbstab.mechanics.quaternion import turned_back
from rbstab.report.runs.paper_cases import changed_keys
from rbstab.store.errors import StoreError
from rbstab.store.result import Result, open_result
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed
from rbstab_cli.output.runs import (
    certificate_checks,
    print_answer,
    print_certificate,
    print_unread_proofs,
    run_data,
)
from rbstab_cli.printing import Table, print_facts, print_json
from rbstab_cli.streams import exact


def show(path: Path, as_json: bool, as_config: bool) -> int | None:
    """Print the content of a file or folder.

    Args:
        path: The file or folder.
        as_json: Whether to print JSON.
        as_config: Whether to print only the stored config.
    """
    try:
        opened = open_result(path)
    except StoreError:
        # Imported late: a run is opened without these modules, and so without waiting for them.
        from rbstab.report.reading.kinds import Kind, kind_of
        from rbstab_cli.work.stored.other import show_other

        kind = kind_of(path)
        if kind is Kind.RUN:
            raise
        return show_other(path, kind, as_json=as_json, as_config=as_config)
    if as_config:
        click.echo(exact(opened.config), nl=False)
        return None
    # Every line is that of the result together with the proof that lies beside it now.
    print_unread_proofs([path.parent])
    try:
        run = AssessedRun(path, opened, stored_config(opened).config)
        if as_json:
            print_json(_data(run))
        else:
            _print(run)
    except (LookupError, ValueError, TypeError, ArithmeticError, AttributeError) as error:
        reason = f"its content is wrong ({type(error).__name__}: {error})"
        raise Failed(exit_codes.STORAGE, f"error: {path} cannot be shown: {reason}") from error
    return None


class _Reference(NamedTuple):
    """What the stored config refers to, with printed and computed values."""

    # Empty if it refers to nothing.
    source: str = ""
    # The keys in which the config differs from the case of its source. With any of them the printed
    # values say nothing about it.
    changed: tuple[str, ...] = ()
    values: tuple[ReferenceValue, ...] = ()


def _reference(result: Result) -> _Reference:
    """Return the reference of the stored config."""
    stored = stored_config(result)
    # The config is None if this version cannot read it; the rest is still shown.
    reference = None if stored.config is None else stored.config.reference
    if stored.config is None or reference is None:
        return _Reference()
    note = f" ({reference.note})" if reference.note else ""
    changed = tuple(changed_keys(stored.config, stored.data))
    values = tuple(reference_values_of(result, reference))
    return _Reference(reference.source + note, changed, values)


def _data(run: AssessedRun) -> dict[str, Any]:
    result = run.now
    reference = _reference(result)
    return {
        **run_data(run),
        "certificate": certificate_checks(result),
        "final": final_state(result),
        "reference": {**reference._asdict(), "values": [v._asdict() for v in reference.values]},
        "arrays": {
            name: {"dimensions": v.dimensions, "shape": v.data.shape, "units": v.unit}
            for name, v in result.variables.items()
        },
        "config": result.config,
    }


SHOWN_ABOVE = ("title", "status", "status_detail", "verdict", "lyapunov_zero", "warnings")
"""Attributes that are not among the provenance."""


def _print(run: AssessedRun) -> None:
    result = run.now
    attributes = result.attributes
    click.echo(printable(str(attributes["title"])))
    print_answer(run.answer, run.config)
    _print_numbers(run)
    print_certificate(result)
    _print_reference(_reference(result))
    table = Table("array", "dimensions", "unit", "meaning")
    for name, variable in result.variables.items():
        # A quantity without a symbol has "-" in its place.
        meaning = variable.long_name.removeprefix("-: ")
        table.add(name, ", ".join(variable.dimensions) or "-", variable.unit, meaning)
    table.print()
    provenance = (
        (name, _provenance(name, value))
        for name, value in attributes.items()
        if name not in SHOWN_ABOVE and name.partition("_")[0] != ATTRIBUTE
    )
    print_facts(provenance, "provenance", "value")


NUMBERS = (
    *("v(0)", "v(end)", "largest v", "start above the rest state of c*", "v(0)/c*"),
    *(f"|r|/{ENERGY_SCALE}", "peak |E|", "peak E1", "peak E2", "peak E3", "peak |θ2|"),
)
"""The numbers of a run, of those that it has."""


def _print_numbers(run: AssessedRun) -> None:
    """Print how the run ended, its Lyapunov function and audit, and its final state."""
    result, attributes = run.now, run.now.attributes
    table = Table("quantity", "value")
    detail = f": {attributes['status_detail']}" if attributes.get("status_detail") else ""
    table.add("status", FACTS["status"].of(run).text + detail)
    table.add("checks of the run", run_words(str(attributes.get("verdict", "-"))))
    if run.convergence is not None and run.convergence.proved is not None:
        table.add("exact motion", run.convergence.sentence)
    table.add("v = 0 at", str(attributes["lyapunov_zero"]))
    Theta = result["rest_orientation"]
    if run.config is not None and run.config.integration.coordinates == "quaternion":
        Theta = turned_back(Theta)
    table.add("", f"Θ = {vector(Theta)} rad")
    table.add("at rest from", FACTS["at rest from"].text(run) or "not in this run")
    for fact in map(FACTS.__getitem__, NUMBERS):
        if fact.text(run):
            table.add(fact.name, fact.text(run))
    if not run.summary.resolved:
        table.add("", f"≥: {UNKNOWN_STEPS}, and the peak may be larger", style="yellow")
    if run.stores_v_minus_work:
        ends = (number(float(result["lyapunov"][place]), 7) for place in (0, -1))
        table.add("v - ε at 0 and at the end", " J, ".join(ends) + " J")
    modes = rest_modes(result, run.config)
    if modes is not None:
        table.add("modes", str(modes))
    if "impact_count" in result:
        table.add("impacts", _impacts(result))
    for name, value in final_state(result).items():
        table.add(f"final {name}", f"{vector(value)} {result.variables[name].unit}")
    for warning in str(attributes.get("warnings", "")).splitlines():
        table.add("warning", warning, style="yellow")
    table.print()


def _provenance(name: str, value: object) -> str:
    """Return an attribute as text: times with their unit, and "-" for what is not known."""
    if name.endswith("wall_time") and isinstance(value, float):
        return f"{number(value, 3)} s"
    return str(value) or "-"


def _impacts(result: Result) -> str:
    """Return how often a body met its stop, what that took away, and whether it rests there."""
    text = f"{int(result['impact_count'][-1])}, which took {number(result['impact_loss'][-1])} J"
    if result["stop_contact"][-1]:
        text += f"; rests against the stop from t = {number(result['rest_begin'][-1])} s"
    return text


def _print_reference(reference: _Reference) -> None:
    if not reference.values:
        return
    click.echo(f"Reference: {printable(reference.source)}")
    if reference.changed:
        keys = ", ".join(map(printable, reference.changed))
        click.echo(f"Printed values are not compared: this config is another case, by {keys}.")
        return
    table = Table("quantity", "printed", "computed", "exact motion")
    for value in reference.values:
        says = "the printed value does not follow, proved" if value.disproved else "-"
        name = f"{value.name} [{value.unit}]"
        table.add(name, vector(value.printed), vector(value.computed), says)
    table.print()
