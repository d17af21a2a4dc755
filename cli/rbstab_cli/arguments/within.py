"""The options --within and --largest-within of `rbstab stability`."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rbstab.config.schema import Config
    from rbstab.config.tolerances import Tolerance
    from rbstab.experiment.robust.largest import Largest
    from rbstab.experiment.robust.record import BodiesRecord
    from rbstab.experiment.start_sets.prove_starts import Progress
    from rbstab.experiment.start_sets.starts_record import StartsProof


SECONDS_OF_BODIES, SECONDS_OF_STARTS = 60.0, 600.0
"""The default limits of time for all bodies and for all starts within tolerances."""

_OF_BODIES = "expected only numbers of body, gravity and controller"


class Within(NamedTuple):
    """What is proved for all bodies, or for all starts, within tolerances of one config.

    texts are the tolerances as given, record is the proof for all bodies, and starts that for all
    starts (None: there are no such tolerances). largest has the result of each --largest-within.
    """

    texts: tuple[str, ...]
    record: "BodiesRecord | None"
    largest: "tuple[Largest, ...]"
    starts: "StartsProof | None" = None

    @property
    def statements(self) -> list[str]:
        """Sentences, the answer first."""
        from rbstab.experiment.robust.sentences import (
            largest_sentences,
            tolerance_names,
            within_sentences,
        )

        found = [] if self.record is None else within_sentences(self.texts, self.record)
        if self.starts is not None:
            starts = f"For every start within {tolerance_names(self.texts)}"
            found = [f"{starts}: {self.starts.sentence}."]
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
            "starts": None if self.starts is None else self.starts.as_data(),
            "largest": [_largest_data(one) for one in self.largest],
        }


def checked_tolerances(
    configs: "Mapping[Path, Config]", texts: tuple[str, ...], largest: tuple[str, ...]
) -> "dict[Path, tuple[Tolerance, ...]]":
    """Return the tolerances of --within for each config, before anything is computed.

    If a text is wrong, print all problems and end the command with exit code 2.

    Args:
        configs: The configs by their paths.
        texts: The values of --within.
        largest: The values of --largest-within; they are checked as well.

    Raises:
        UsageError: A value of --largest-within is another option: its key was left out.
    """
    from rbstab.config.errors import ConfigError
    from rbstab.config.tolerances import tolerances_of, tolerances_of_key
    from rbstab_cli.arguments.configs import exit_on_problems

    for key in largest:
        if key.startswith("-"):
            raise click.UsageError(
                f"--largest-within needs a KEY, such as controller.K_r; {key} is an option"
            )
    problems: dict[str, None] = {}
    found = {}
    for path, config in configs.items():
        try:
            found[path] = tolerances_of(config, texts)
            searched = {
                key: tolerances_of_key(config, key, "--largest-within", texts) for key in largest
            }
        except ConfigError as error:
            problems.update(dict.fromkeys(str(problem) for problem in error.problems))
        else:
            problems.update(dict.fromkeys(_mixed(found[path], searched)))
    exit_on_problems(problems)
    return found


def _mixed(
    given: "Sequence[Tolerance]", searched: "Mapping[str, Sequence[Tolerance]]"
) -> list[str]:
    """Return what is wrong with tolerances that cannot be proved together.

    Args:
        given: The tolerances of --within.
        searched: By the values of --largest-within, the tolerances of each beside the given ones.
    """
    starts = [one for one in given if one.section == "initial"]
    others = [one for one in given if one.section != "initial"]
    if searched and starts:
        return [
            f"--within: {starts[0].entry.key} is a number of the initial state (beside "
            f"--largest-within, {_OF_BODIES})"
        ]
    for key, tolerances in searched.items():
        own = [one.entry.key for one in tolerances if one.section == "initial"]
        if own:
            return [
                f"--largest-within {key}: {own[0]} is a number of the initial state ({_OF_BODIES})"
            ]
    if starts and others:
        return [
            f"--within: both {starts[0].entry.key} and {others[0].entry.key} have a tolerance "
            f"(expected tolerances of the initial state alone, or of body, gravity and "
            f"controller alone)"
        ]
    return []


def are_of_starts(tolerances: "Sequence[Tolerance]") -> bool:
    """Return whether the checked tolerances of one config are those of its initial state."""
    return bool(tolerances) and tolerances[0].section == "initial"


def proved_within(
    config: "Config",
    results: Path,
    texts: tuple[str, ...],
    tolerances: "tuple[Tolerance, ...]",
    largest: tuple[str, ...],
    progress: "Progress | None",
    time_limit: float | None,
) -> Within | None:
    """Prove the tolerances of the options for one config; None without these options.

    Args:
        config: The config.
        results: The folder of results, which contains the stored proofs.
        texts: The values of --within.
        tolerances: Their tolerances, from `checked_tolerances`.
        largest: The values of --largest-within.
        progress: Called during a proof for all starts, see `prove_starts`.
        time_limit: The wall time for the tolerances, and for each key of `largest`, s; by default
            `SECONDS_OF_BODIES` or `SECONDS_OF_STARTS`.
    """
    from rbstab.experiment.robust.largest import largest_within

    if not texts and not largest:
        return None
    if time_limit is None:
        time_limit = SECONDS_OF_STARTS if are_of_starts(tolerances) else SECONDS_OF_BODIES
    if are_of_starts(tolerances):
        starts = _proved_starts(config, results, tolerances, progress, _late_after(time_limit))
        return Within(texts, None, (), starts)
    record = _prove(config, results, _late_after(time_limit))(tolerances) if texts else None
    found = []
    for key in largest:
        is_late = _late_after(time_limit)
        prove = _prove(config, results, is_late)
        found.append(largest_within(config, prove, key, texts, is_late))
    return Within(texts, record, tuple(found))


def _late_after(time_limit: float) -> "Callable[[], bool]":
    """Return a function that tells whether some seconds from now are over."""
    end = time.monotonic() + time_limit
    return lambda: time.monotonic() > end


def _proved_starts(
    config: "Config",
    results: Path,
    tolerances: "tuple[Tolerance, ...]",
    progress: "Progress | None",
    is_late: "Callable[[], bool]",
) -> "StartsProof":
    from rbstab.experiment.start_sets.prove_starts import starts_for
    from rbstab.processes.processors import processor_count

    found, problem = starts_for(
        results,
        config,
        tolerances,
        processes=processor_count(),
        progress=progress,
        is_late=is_late,
    )
    if problem is not None:
        # Print the proof although it cannot be read or stored.
        click.echo(f"warning: {problem}; the proof is not stored", err=True)
    return found


def _prove(
    config: "Config", results: Path, is_late: "Callable[[], bool]"
) -> "Callable[[Sequence[Tolerance]], BodiesRecord]":
    from rbstab.experiment.robust.bodies import bodies_for, prove_within
    from rbstab.store.errors import StoreError

    def prove(tolerances: "Sequence[Tolerance]") -> "BodiesRecord":
        try:
            return bodies_for(results, config, tolerances, is_late)
        except StoreError as error:
            # Print the proof although it cannot be read or stored.
            click.echo(f"warning: {error}; the proof is not stored", err=True)
            return prove_within(config, tolerances, is_late=is_late)

    return prove


def _largest_data(found: "Largest") -> dict[str, Any]:
    from rbstab.config.tolerances import decimal_text

    def text(number: Any) -> str | None:
        return None if number is None else decimal_text(number)

    return {
        "key": found.key,
        "time_limit_reached": found.late,
        "percent": text(found.percent),
        "proof": None if found.record is None else found.record.model_dump(mode="json"),
        "not_proved_percent": text(found.not_proved),
        "not_proved": None if found.why is None else found.why.model_dump(mode="json"),
    }
