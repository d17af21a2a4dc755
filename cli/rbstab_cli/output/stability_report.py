"""Results of `rbstab stability` for one config, and their conversion to plain data."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from rbstab.analysis.linearisation import Linearisation
    from rbstab.config.schema import Config
    from rbstab.experiment.locus import LocusPoint
    from rbstab.experiment.stability import Stability
    from rbstab.store.result import Result
    from rbstab_cli.arguments.along import Along
    from rbstab_cli.arguments.within import Within


class StabilityReport(NamedTuple):
    """A config, its stability, its run (None with --no-run), and its root loci.

    within is what is proved within tolerances; None if there are none.
    """

    path: Path
    config: "Config"
    stability: "Stability"
    run: "Result | None"
    loci: "list[tuple[Along, list[LocusPoint]]]"
    within: "Within | None" = None


def stability_data(report: StabilityReport) -> dict[str, Any]:
    """Return all results for one config as plain data."""
    # Imported late: `Stability` is imported with the first config.
    from rbstab.experiment.stored_proof.almost_every_start import almost_every_start
    from rbstab_cli.output.certificate import certificate_checks

    stability, run = report.stability, report.run
    # The reduced energy is only needed where a proof is used or checked.
    proof = stability.proof.model_dump(mode="json", exclude={"reduced_energy"})
    states = zip(proof.pop("states"), stability.linearisations, strict=True)
    certificate = None
    if run is not None:
        verdict, status = run.attributes["verdict"], run.status
        certificate = {"verdict": verdict, "status": status, "lines": certificate_checks(run)}
    return {
        "config": str(report.path),
        "title": report.config.title,
        "statements": stability.statements,
        "within": None if report.within is None else report.within.as_data(),
        "start": stability.start,
        "inside": stability.inside,
        "convergence": None if stability.convergence is None else stability.convergence.as_data(),
        "reached": stability.reached,
        # A run has an outcome of its own.
        "search": proof.pop("outcome"),
        **proof,
        "stable_count": stability.proof.stable_count,
        "every_start": stability.proof.every_start,
        "almost_every_start": almost_every_start(stability.proof).as_data(),
        "states": [{**state, "modes": mode_data(linear)} for state, linear in states],
        "certificate": certificate,
        "along": [_locus_data(report.config, along, points) for along, points in report.loci],
    }


def mode_data(linear: "Linearisation | None") -> list[dict[str, Any]]:
    """Return the modes, slowest first; a conjugate pair is given by the mode with Im λ > 0."""
    modes: list[dict[str, Any]] = []
    if linear is None:
        return modes
    for k, value in enumerate(linear.eigenvalues):
        if value.imag < 0:
            continue
        shape = linear.modes[:, k]
        modes.append(
            {
                "eigenvalue": [float(value.real), float(value.imag)],
                "natural_frequency": float(linear.natural_frequencies[k]),
                "damping_ratio": float(linear.damping_ratios[k]),
                "time_constant": float(linear.time_constants[k]),
                "largest": linear.states[int(abs(shape).argmax())],
                "shape": {
                    name: [float(entry.real), float(entry.imag)]
                    for name, entry in zip(linear.states, shape, strict=True)
                },
            }
        )
    return modes


def _locus_data(config: "Config", along: "Along", points: "list[LocusPoint]") -> dict[str, Any]:
    from rbstab.experiment.answers.threshold import named_number
    from rbstab.experiment.locus import stable_from

    gain = named_number(config, along.path)
    return {
        "key": along.key,
        "number": gain.name,
        "unit": gain.unit,
        "stable": stable_from(config, gain, points) or None,
        "points": [
            {
                "factor": factor,
                "value": factor * gain.value,
                "found": found,
                "orientation": Theta,
                "eigenvalues": []
                if linear is None
                else [[float(v.real), float(v.imag)] for v in linear.eigenvalues],
            }
            for factor, found, linear, Theta in points
        ],
    }
