"""The options --within and --largest-within of `rbstab stability`."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbstab.config.schema import Config
    from rbstab.config.tolerances import Tolerance
    from rbstab.experiment.robust.largest import Largest
    from rbstab.experiment.robust.record import BodiesRecord


class Within(NamedTuple):
    """What is proved for all bodies within tolerances of one config.

    texts are the tolerances as given, record is their proof (None if --within is not given), and
    largest has the result of each --largest-within.
    """

    texts: tuple[str, ...]
    record: "BodiesRecord | None"
    largest: "tuple[Largest, ...]"

    @property
    def statements(self) -> list[str]:
        """Sentences, the answer first."""
        from rbstab.experiment.robust.sentences import largest_sentences, within_sentences

        found = [] if self.record is None else within_sentences(self.texts, self.record)
        return [
            *found,
            *(line for one in self.largest for line in largest_sentences(one, self.texts)),
        ]

    def as_data(self) -> dict[str, Any]:
        """Return all results as plain data."""
        return {
            "statements": self.statements,
            "tolerances": list(self.texts),
            "proof": None if self.record is None else self.record.model_dump(mode="json"),
            "largest": [_largest_data(one) for one in self.largest],
        }


def proved_within(
    config: "Config", results: Path, texts: tuple[str, ...], largest: tuple[str, ...]
) -> Within | None:
    """Prove the tolerances of the options for one config; None without these options.

    Raises:
        UsageError: A tolerance is wrong, or is one of the initial state.
    """
    from rbstab.experiment.robust.largest import largest_within, proving

    if not texts and not largest:
        return None
    prove = _prove(config, results)
    # All options are checked before the first proof, which may take long.
    tolerances = _checked(config, texts)
    for key in largest:
        _checked(config, (*texts, f"{key}=±0.001%"), option="--largest-within")
    record = prove(tolerances) if texts else None
    found = [largest_within(proving(config, prove), key, texts) for key in largest]
    return Within(texts, record, tuple(found))


def _checked(
    config: "Config", texts: tuple[str, ...], option: str = "--within"
) -> "tuple[Tolerance, ...]":
    """Return the tolerances of some texts, all of them of a body, its gravity or controller."""
    from rbstab.config.errors import ConfigError
    from rbstab.config.tolerances import tolerances_of

    try:
        tolerances = tolerances_of(config, texts)
    except ConfigError as error:
        raise click.UsageError("\n".join(str(problem) for problem in error.problems)) from error
    for one in tolerances:
        if one.section == "initial":
            raise click.UsageError(
                f"{option}: {one.entry.key} is a number of the initial state; expected one of "
                "body, gravity or controller"
            )
    return tolerances


def _prove(config: "Config", results: Path) -> "Callable[[Sequence[Tolerance]], BodiesRecord]":
    from rbstab.experiment.robust.bodies import prove_within
    from rbstab.experiment.robust.cache import bodies_for
    from rbstab.store.errors import StoreError

    def prove(tolerances: "Sequence[Tolerance]") -> "BodiesRecord":
        try:
            return bodies_for(results, config, tolerances)
        except StoreError as error:
            # Print the proof although it cannot be read or stored.
            click.echo(f"warning: {error}; the proof is not stored", err=True)
            return prove_within(config, tolerances)

    return prove


def _largest_data(found: "Largest") -> dict[str, Any]:
    from rbstab.experiment.robust.record import decimal_text

    def text(number: Any) -> str | None:
        return None if number is None else decimal_text(number)

    return {
        "key": found.key,
        "percent": text(found.percent),
        "proof": None if found.record is None else found.record.model_dump(mode="json"),
        "not_proved_percent": text(found.not_proved),
        "not_proved": None if found.why is None else found.why.model_dump(mode="json"),
    }
