"""What `rbstab stability` found out about one config, and the same as plain data."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from rbstab.analysis.linearisation import Linearisation
    from rbstab.config.schema import Config
    from rbstab.experiment.locus import LocusPoint
    from rbstab.experiment.stability import Stability
    from rbstab.store.result import Result
    from rbstab_cli.arguments.along import Along


class StabilityReport(NamedTuple):
    """A config, what is proved of it, its run if that was wanted, and its root loci."""

    path: Path
    config: "Config"
    stability: "Stability"
    run: "Result | None"
    loci: "list[tuple[Along, list[LocusPoint]]]"


def data_of(answer: StabilityReport) -> dict[str, Any]:
    """Everything that is known of one config."""
    from rbstab_cli.output.certificate import lines_of

    stability, run = answer.stability, answer.run
    proof = stability.proof.model_dump(mode="json")
    states = zip(proof.pop("states"), stability.linearisations, strict=True)
    certificate = None
    if run is not None:
        verdict, status = run.attributes["verdict"], run.status
        certificate = {"verdict": verdict, "status": status, "lines": lines_of(run)}
    return {
        "config": str(answer.path),
        "title": answer.config.title,
        "statements": stability.statements,
        "start": stability.start,
        "inside": stability.inside,
        **proof,
        "states": [{**state, "modes": modes_of(linear)} for state, linear in states],
        "certificate": certificate,
        "along": [{"key": along.key, "points": _points(points)} for along, points in answer.loci],
    }


def modes_of(linear: "Linearisation") -> list[dict[str, Any]]:
    """The modes, slowest first; of a conjugate pair the one with the positive imaginary part."""
    found = []
    for k, value in enumerate(linear.eigenvalues):
        if value.imag < 0:
            continue
        shape = linear.modes[:, k]
        found.append(
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
    return found


def _points(points: "list[LocusPoint]") -> list[dict[str, Any]]:
    return [
        {
            "factor": factor,
            "found": found,
            "eigenvalues": []
            if linear is None
            else [[float(v.real), float(v.imag)] for v in linear.eigenvalues],
        }
        for factor, found, linear in points
    ]
