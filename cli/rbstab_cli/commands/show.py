"""`rbstab show`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from rbstab_cli import exit_codes
from rbstab_cli.output.stored.unread_proofs import print_unread_proofs

if TYPE_CHECKING:
    from rbstab.experiment.convergence.with_proof import KnownNow
    from rbstab.experiment.summary import ReferenceValue
    from rbstab.mechanics.numbers import Array
    from rbstab.store.result import Result


@click.command("show")
@click.argument("result", metavar="RESULT", type=click.Path(path_type=Path))
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print everything as JSON, except the values of the arrays.",
)
@click.option(
    "--config",
    "as_config",
    is_flag=True,
    help="Print only the stored config, which can be run as it is.",
)
def command(result: Path, as_json: bool, as_config: bool) -> None:
    """Show the content of a result.

    Prints first what is known about stability: of this start, and of every start. Then follow the
    status of the run, its Lyapunov function and audit, its final state, the checks of its
    certificate, the values that its reference prints beside the computed ones, the arrays in the
    file, and its provenance.

    A proof that was stored in the folder of the result after the run counts too.

    RESULT may also be the folder of a sweep, a file or folder in it, a proof, a folder of proofs,
    or a folder of results. Of a sweep it prints first how many members are proved, or seen, to come
    to rest.
    """
    from rbstab.store.errors import StoreError
    from rbstab.store.result import open_result

    if as_json and as_config:
        raise click.UsageError("--json cannot be combined with --config")
    try:
        opened = open_result(result)
    except StoreError as error:
        if _shown_as_other(result, as_json=as_json, as_config=as_config):
            return
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    try:
        _print(result, opened, as_json=as_json, as_config=as_config)
    except (LookupError, ValueError, TypeError, ArithmeticError, AttributeError) as error:
        reason = f"{type(error).__name__}: {error}"
        click.echo(f"error: {result} cannot be shown: its content is wrong ({reason})", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error


def _shown_as_other(path: Path, *, as_json: bool, as_config: bool) -> bool:
    """Show what is not the file of a run, and return True; False if it should be such a file."""
    # Imported late: a run is opened without these modules, and so without waiting for them.
    from rbstab.listing.kinds import Kind, kind_of
    from rbstab.report.reading.not_results import what_it_is
    from rbstab.store.errors import StoreError
    from rbstab_cli.output.stored.files import show_other

    try:
        if kind_of(path) is Kind.RUN and what_it_is(path) is None:
            return False
        show_other(path, as_json=as_json, as_config=as_config)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    return True


def _print(path: Path, opened: "Result", *, as_json: bool, as_config: bool) -> None:
    if as_config:
        from rbstab_cli.streams import exact

        click.echo(exact(opened.config), nl=False)
        return
    # Imported late: --config needs none of it.
    from rbstab.experiment.convergence.with_proof import known_now

    # Every line is that of the result together with the proof that lies beside it now.
    print_unread_proofs([path.parent])
    known = known_now(path, opened)
    if as_json:
        _print_json(known)
    else:
        _print_tables(known)


class _Reference(NamedTuple):
    """What the stored config refers to.

    source is empty if it refers to nothing. changed are the keys in which the config differs from
    the case of its source: then printed values say nothing about it.
    """

    source: str
    values: list["ReferenceValue"]
    changed: list[str]


def _reference(result: "Result") -> _Reference:
    """Return the reference of the stored config, with printed and computed values."""
    from rbstab.experiment.stored_config import stored_config
    from rbstab.experiment.summary import reference_values_of
    from rbstab.report.runs.paper_cases import changed_keys

    # The config is None if this version cannot read it; the rest is still shown.
    stored = stored_config(result)
    reference = stored.config.reference if stored.config is not None else None
    if stored.config is None or reference is None:
        return _Reference("", [], [])
    note = f" ({reference.note})" if reference.note else ""
    changed = list(changed_keys(stored.config, stored.data))
    return _Reference(reference.source + note, reference_values_of(result, reference), changed)


def _print_json(known: "KnownNow") -> None:
    from rbstab.experiment.own_states import final_state
    from rbstab_cli.output.certificate import certificate_checks
    from rbstab_cli.output.facts import run_data
    from rbstab_cli.output.json_output import print_json

    result = known.result
    found = _reference(result)
    arrays: dict[str, Any] = {
        name: {"dimensions": v.dimensions, "shape": v.data.shape, "units": v.unit}
        for name, v in result.variables.items()
    }
    reference = {
        "source": found.source,
        "changed": found.changed,
        "values": [value._asdict() for value in found.values],
    }
    more = {
        "certificate": certificate_checks(result),
        "final": final_state(result),
        "reference": reference,
    }
    print_json(
        {
            **run_data(result, known.config, known.proof),
            **more,
            "arrays": arrays,
            "config": result.config,
        }
    )


def _print_tables(known: "KnownNow") -> None:
    from rbstab.analysis.lyapunov import ENERGY_SCALE
    from rbstab.config.errors import printable
    from rbstab.experiment.answers.run_answer import answer_of
    from rbstab.experiment.answers.words import run_words
    from rbstab.experiment.convergence.convergence import ATTRIBUTE, stored_convergence
    from rbstab.experiment.own_states import final_state
    from rbstab.experiment.summary import at_least, summary_of
    from rbstab_cli.output.answers import print_answer
    from rbstab_cli.output.certificate import print_certificate
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    result = known.result
    s, attributes = summary_of(result), result.attributes
    click.echo(printable(str(attributes["title"])))
    print_answer(answer_of(result, known.config, known.proof), known.config)
    table = new_table("quantity", "value")
    detail = f": {attributes['status_detail']}" if attributes.get("status_detail") else ""
    add_row(table, "status", result.status + detail)
    add_row(table, "checks of the run", run_words(str(attributes.get("verdict", "-"))))
    convergence = stored_convergence(attributes)
    if convergence is not None and convergence.proved is not None:
        add_row(table, "exact motion", convergence.sentence)
    for name, ends in _ends_of_v(result).items():
        add_row(table, name, ends)
    for name, text in _zero_of_v(known):
        add_row(table, name, text)
    add_row(table, f"max |r| / {ENERGY_SCALE}", number(s.relative_residual, 2))
    peak = "peak E by axis" if s.displacement_resolved else "largest sample of E by axis"
    add_row(table, peak, _vector(s.peak_contact_displacement) + " m")
    add_row(table, "max |θ2|", f"{at_least(s.pitch_resolved)}{number(s.largest_pitch)} rad")
    if not s.resolved:
        why = "the motion is faster than its samples; more `integration.samples` show its peaks"
        add_row(table, "", why, style="yellow")
    if "impact_count" in result:
        add_row(table, "impacts", _impacts(result))
    for name, value in final_state(result).items():
        add_row(table, f"final {name}", f"{_vector(value)} {result.variables[name].unit}")
    for warning in str(attributes.get("warnings", "")).splitlines():
        add_row(table, "warning", warning, style="yellow")
    print_table(table)
    print_certificate(result)
    _print_reference(result)
    table = new_table("array", "dimensions", "unit", "meaning")
    for name, variable in result.variables.items():
        dimensions = ", ".join(variable.dimensions) or "-"
        # A quantity without a symbol has "-" in its place.
        meaning = variable.long_name.removeprefix("-: ")
        add_row(table, name, dimensions, variable.unit, meaning)
    print_table(table)
    table = new_table("provenance", "value")
    for name in attributes:
        if name in _SHOWN_ABOVE or name.partition("_")[0] == ATTRIBUTE:
            continue
        add_row(table, name, _provenance(name, attributes[name]))
    print_table(table)


def _provenance(name: str, value: object) -> str:
    """Return an attribute as text: times with their unit, and "-" for what is not known."""
    from rbstab_cli.output.tables import number

    if name.endswith("wall_time") and isinstance(value, float):
        return f"{number(value, 3)} s"
    return str(value) or "-"


def _ends_of_v(result: "Result") -> dict[str, str]:
    """Return v at 0 and at the end; and v - ε, by its name, where the result stores that."""
    from rbstab.experiment.summary import lyapunov_function_of, stores_v_minus_work
    from rbstab_cli.output.tables import number

    def ends(values: "Array") -> str:
        return ", ".join(f"{number(float(value), 7)} J" for value in (values[0], values[-1]))

    v = {"v(0), v(end)": ends(lyapunov_function_of(result))}
    if not stores_v_minus_work(result):
        return v
    return v | {"v - ε at 0 and at the end": ends(result["lyapunov"])}


def _zero_of_v(known: "KnownNow") -> list[tuple[str, str]]:
    """Return the rest state at which v is zero, and the modes there."""
    from rbstab.experiment.answers.rest_modes import rest_modes

    result = known.result
    rows = [("v = 0 at", str(result.attributes["lyapunov_zero"]))]
    rows.append(("", f"Θ = {_vector(result['rest_orientation'])} rad"))
    modes = rest_modes(result, known.config)
    return rows if modes is None else [*rows, ("modes", str(modes))]


def _impacts(result: "Result") -> str:
    """Return how often a body met its stop, what that took away, and whether it rests there."""
    from rbstab_cli.output.tables import number

    text = f"{int(result['impact_count'][-1])}, which took {number(result['impact_loss'][-1])} J"
    if result["stop_contact"][-1]:
        text += f"; rests against the stop from t = {number(result['rest_begin'][-1])} s"
    return text


_SHOWN_ABOVE = ("title", "status", "status_detail", "verdict", "lyapunov_zero", "warnings")


def _print_reference(result: "Result") -> None:
    from rbstab.config.errors import printable
    from rbstab_cli.output.tables import add_row, new_table, print_table

    found = _reference(result)
    if not found.values:
        return
    click.echo(f"Reference: {printable(found.source)}")
    if found.changed:
        keys = ", ".join(map(printable, found.changed))
        click.echo(f"Printed values are not compared: this config is another case, by {keys}.")
        return
    table = new_table("quantity", "printed", "computed", "exact motion")
    for c in found.values:
        exact = "the printed value does not follow, proved" if c.disproved else "-"
        add_row(table, f"{c.name} [{c.unit}]", _vector(c.printed), _vector(c.computed), exact)
    print_table(table)


def _vector(values: Any) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
