"""The options --within and --largest-within of `rbstab stability`."""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

from rbstab.config.errors import ConfigError
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance, decimal_text, tolerances_of, tolerances_of_key
from rbstab.experiment.robust.bodies import bodies_for, prove_within
from rbstab.experiment.robust.largest import Largest, largest_within
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.experiment.robust.sentences import largest_sentences, tolerance_names, within_sentences
from rbstab.experiment.start_sets.prove_starts import starts_for
from rbstab.experiment.start_sets.starts_record import MAX_PARTS, StartsProof
from rbstab.processes.processors import processor_count
from rbstab.store.errors import StoreError
from rbstab_cli.inputs import refuse
from rbstab_cli.output.progress import Work, working
from rbstab_cli.printing import say

SECONDS_OF_BODIES, SECONDS_OF_STARTS = 60.0, 600.0
"""The default limits of time for all bodies and for all starts within tolerances."""


class Within(NamedTuple):
    """What is proved for all bodies, or for all starts, within tolerances of one config.

    texts are the tolerances as given, record is the proof for all bodies, and starts that for all
    starts (None: there are no such tolerances). largest has the result of each --largest-within.
    """

    texts: tuple[str, ...]
    record: BodiesRecord | None = None
    starts: StartsProof | None = None
    largest: tuple[Largest, ...] = ()

    @property
    def statements(self) -> list[str]:
        """Sentences, the answer first."""
        sentences = [] if self.record is None else within_sentences(self.texts, self.record)
        if self.starts is not None:
            starts = f"For every start within {tolerance_names(self.texts)}"
            sentences = [f"{starts}: {self.starts.sentence}."]
        return [
            *sentences,
            *(line for largest in self.largest for line in largest_sentences(largest, self.texts)),
        ]

    def as_data(self) -> dict[str, Any]:
        """Return all results as plain data."""
        return {
            "statements": self.statements,
            "tolerances": list(self.texts),
            "proof": _record_data(self.record),
            "starts": None if self.starts is None else self.starts.as_data(),
            "largest": [
                {
                    "key": largest.key,
                    "time_limit_reached": largest.late,
                    "percent": _text(largest.percent),
                    "proof": _record_data(largest.record),
                    "not_proved_percent": _text(largest.not_proved),
                    "not_proved": _record_data(largest.why),
                }
                for largest in self.largest
            ],
        }


def _text(percent: Any) -> str | None:
    return None if percent is None else decimal_text(percent)


def _record_data(record: Any) -> Any:
    return None if record is None else record.model_dump(mode="json")


def checked_tolerances(
    configs: Mapping[Path, Config], texts: tuple[str, ...], largest: tuple[str, ...]
) -> dict[Path, tuple[Tolerance, ...]]:
    """Return the tolerances of --within for each config, before anything is computed.

    If a text is wrong, all problems are printed, and the command ends with exit code 2.

    Args:
        configs: The configs by their paths.
        texts: The values of --within.
        largest: The values of --largest-within; they are checked as well.

    Raises:
        UsageError: A value of --largest-within is another option: its key was left out.
    """
    for key in largest:
        if key.startswith("-"):
            raise click.UsageError(
                f"--largest-within needs a KEY, such as controller.K_r; {key} is an option"
            )
    problems: list[str] = []
    tolerances = {}
    for path, config in configs.items():
        try:
            tolerances[path] = tolerances_of(config, texts)
            searched = {
                key: tolerances_of_key(config, key, "--largest-within", texts) for key in largest
            }
        except ConfigError as error:
            problems += map(str, error.problems)
        else:
            problems += _mixed(tolerances[path], searched)
    refuse(problems)
    return tolerances


def _mixed(given: Sequence[Tolerance], searched: Mapping[str, Sequence[Tolerance]]) -> list[str]:
    """Return what is wrong with tolerances that cannot be proved together."""
    # Those of --within, and those that each --largest-within needs beside them.
    every = [*given, *(tolerance for tolerances in searched.values() for tolerance in tolerances)]
    starts = [tolerance.entry.key for tolerance in every if are_of_starts([tolerance])]
    if not starts or (len(starts) == len(given) and not searched):
        return []
    alone = "expected tolerances of the initial state alone, by --within"
    return [f"{starts[0]}: is a number of the initial state, beside other tolerances ({alone})"]


def are_of_starts(tolerances: Sequence[Tolerance]) -> bool:
    """Return whether the checked tolerances of one config are those of its initial state."""
    return bool(tolerances) and tolerances[0].section == "initial"


def proved_within(
    name: str,
    config: Config,
    results: Path,
    texts: tuple[str, ...],
    tolerances: tuple[Tolerance, ...],
    largest: tuple[str, ...],
    time_limit: float | None,
) -> Within:
    """Prove the tolerances of the options for one config.

    Args:
        name: The name of the config, for progress.
        config: The config.
        results: The folder of results, which contains the stored proofs.
        texts: The values of --within.
        tolerances: Their tolerances, from `checked_tolerances`.
        largest: The values of --largest-within.
        time_limit: The wall time for the tolerances, and for each key of `largest`, s; by default
            `SECONDS_OF_BODIES` or `SECONDS_OF_STARTS`.
    """
    of_starts = are_of_starts(tolerances)
    limit = time_limit or (SECONDS_OF_STARTS if of_starts else SECONDS_OF_BODIES)

    def proved(key: str) -> Largest:
        is_late = late_after(limit)
        return largest_within(config, _prove(config, results, is_late), key, texts, is_late)

    with working(f"{name}: all {'starts' if of_starts else 'bodies'}") as work:
        is_late = late_after(limit)
        if of_starts:
            return Within(texts, starts=_proved_starts(config, results, tolerances, is_late, work))
        record = _prove(config, results, is_late)(tolerances) if texts else None
        return Within(texts, record, largest=tuple(map(proved, largest)))


def late_after(time_limit: float) -> Callable[[], bool]:
    """Return a function that tells whether some seconds from now are over."""
    end = time.monotonic() + time_limit
    return lambda: time.monotonic() > end


def _proved_starts(
    config: Config,
    results: Path,
    tolerances: tuple[Tolerance, ...],
    is_late: Callable[[], bool],
    work: Work,
) -> StartsProof:
    """Prove all starts; say first how much work there may be, and how to stop it."""
    work.hint(
        f"All starts, in at most {MAX_PARTS} parts of up to a minute each; smaller tolerances "
        "need fewer. Ctrl-C stops, and then nothing is stored."
    )
    proof, problem = starts_for(
        results,
        config,
        tolerances,
        processes=processor_count(),
        progress=lambda fraction, left: work.update(
            f"{100 * fraction:.4g} % proved, {left} parts left", fraction
        ),
        is_late=is_late,
    )
    if problem is not None:
        # Print the proof although it cannot be read or stored.
        say(f"warning: {problem}; the proof is not stored")
    return proof


def _prove(
    config: Config, results: Path, is_late: Callable[[], bool]
) -> Callable[[Sequence[Tolerance]], BodiesRecord]:
    def prove(tolerances: Sequence[Tolerance]) -> BodiesRecord:
        try:
            return bodies_for(results, config, tolerances, is_late)
        except StoreError as error:
            # Print the proof although it cannot be read or stored.
            say(f"warning: {error}; the proof is not stored")
            return prove_within(config, tolerances, is_late=is_late)

    return prove
