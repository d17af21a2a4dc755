"""The ratio to the bare loop that summaries can reach at most, beside the one that is reached.

Processor time, in turns, so that other programs on the machine count little.
"""

import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import median
from threading import Thread

from benchmarks.measure import line
from benchmarks.swept import MAX_LOOP_MEMBERS, Sweeping, plan_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.folder.open_folder import open_folder
from rbstab.sweep.members.engine import Shard
from rbstab.sweep.members.ensemble import EnsembleEngine

MEMBERS = 2 * MAX_LOOP_MEMBERS
SAMPLES = 201
CHUNK = 1024
ROUNDS = 9

TEXTS = {
    "loop": "the bare loop",
    "integrated": "integrated; samples copied; E, Theta and energies at all samples",
    "written": "shards written",
    "sweep": "all of a sweep, without gathering",
}


def main() -> None:
    """Measure visco-elastic members with 201 samples at a tolerance of 1e-8."""
    # As in a sweep: in the main thread glibc returns freed memory at once.
    thread = Thread(target=_measure)
    thread.start()
    thread.join()


def _measure() -> None:
    sweeping = Sweeping(plan_of(MEMBERS, SAMPLES), 1)
    actions: dict[str, Callable[[], object]] = {
        "loop": sweeping.bare_loop(),
        "integrated": lambda: _integrate(sweeping),
        "written": _writer(sweeping),
        "sweep": lambda: sweeping.seconds(gathered=False),
    }
    counts = dict.fromkeys(actions, MEMBERS) | {"loop": MAX_LOOP_MEMBERS}
    taken: dict[str, list[float]] = {name: [] for name in actions}
    for turn in range(ROUNDS + 1):
        for name, action in actions.items():
            begin = time.process_time()
            action()
            # The first turn warms up.
            if turn:
                taken[name].append((time.process_time() - begin) / counts[name])
    needed = zip(taken["integrated"], taken["written"], strict=True)
    ratio = _ratio(taken["loop"], taken["sweep"])
    line("summaries: ratio to the bare loop", ratio, "", "at least 0.8")
    line("  ratio that can be reached at most", _ratio(taken["loop"], map(sum, needed)), "", "")
    for name, text in TEXTS.items():
        line(f"  {text}", 1e6 * median(taken[name]), "us", "")


def _integrate(sweeping: Sweeping) -> None:
    """Do what no program can leave out after the loop: keep the samples, and evaluate them."""
    assert isinstance(sweeping.engine, EnsembleEngine)
    engine = sweeping.engine.variant_engines["visco-elastic"]
    values = sweeping.plan.values(0, MEMBERS)
    order = engine.order(values)
    parameters, starts = engine.binding.parameters_and_starts(values)
    for first in range(0, MEMBERS, CHUNK):
        chosen = order[first : first + CHUNK]
        motions = engine.ensemble.run(parameters[:, chosen], starts[:, chosen])
        assert motions.samples is not None
        engine.at_ends.along(motions.parameters, motions.samples, engine.problem.times)


def _writer(sweeping: Sweeping) -> Callable[[], None]:
    """Return the function that writes all shards, whose columns are computed already."""
    outcome = sweeping.engine.compute(0, MEMBERS).outcome

    def write() -> None:
        with (
            tempfile.TemporaryDirectory(dir="results") as folder,
            open_folder(Path(folder) / "sweep", sweeping.plan, None) as place,
        ):
            for number in range(place.folder.shards):
                start, stop = place.folder.bounds(number)
                part: dict[str, Array] = {n: column[start:stop] for n, column in outcome.items()}
                place.folder.write(sweeping.plan, number, Shard(part))

    return write


def _ratio(numerators: Iterable[float], denominators: Iterable[float]) -> float:
    """Return the median of the ratios of all turns."""
    return median(a / b for a, b in zip(numerators, denominators, strict=True))


if __name__ == "__main__":
    main()
