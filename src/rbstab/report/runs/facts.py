"""What a report says of a run beside its arrays, each found once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rbstab.analysis.certificate import Verdict
from rbstab.experiment.certified import proved_checks
from rbstab.experiment.proof import Proof
from rbstab.experiment.proof_cache import cached_proof, proof_file
from rbstab.experiment.stored_certificate import CertificateLine, certificate_lines
from rbstab.experiment.summary import Comparison, comparisons_of
from rbstab.report.reading.sources import Run

REGION = "certified region"
"""The line of a certificate that says whether a run starts in its certified region."""


@dataclass(frozen=True, eq=False)
class RunFacts:
    """A run, and what is known of it.

    Args:
        run: The run.
        lines: Of its certificate.
        proof: What is proved of its body, gravity and controller; None where nothing is kept.
        inside: Whether it starts in its certified region; None where that is not known.
        comparisons: The values of its config's `reference` beside its own.
    """

    run: Run
    lines: tuple[CertificateLine, ...]
    proof: Proof | None
    inside: bool | None
    comparisons: tuple[Comparison, ...]

    def attribute(self, name: str) -> str:
        """An attribute of the result as text, "" where it has none."""
        return str(self.run.result.attributes.get(name, ""))


def facts_of(runs: Sequence[Run]) -> tuple[RunFacts, ...]:
    """The facts of runs, in their order."""
    proofs: dict[Path, Proof | None] = {}
    return tuple(_facts(run, _proof(run, proofs)) for run in runs)


def _facts(run: Run, proof: Proof | None) -> RunFacts:
    result, config = run.result, run.config
    reference = config.reference if config is not None else None
    found = comparisons_of(result, reference, run.summary) if reference is not None else []
    lines = tuple(certificate_lines(result))
    return RunFacts(
        run=run,
        lines=lines,
        proof=proof,
        inside=_inside(run, lines, proof),
        comparisons=tuple(found),
    )


def _proof(run: Run, known: dict[Path, Proof | None]) -> Proof | None:
    """The kept proof beside a result; many runs have the same."""
    if run.config is None:
        return None
    path = proof_file(run.path.parent, run.config)
    if path not in known:
        known[path] = cached_proof(run.path.parent, run.config)
    return known[path]


def _inside(run: Run, lines: Sequence[CertificateLine], proof: Proof | None) -> bool | None:
    """As the certificate says; where it was made before there was a proof, as that says now."""
    stored = [(line.verdict, line.value) for line in lines if line.check == REGION]
    if (not stored or math.isnan(stored[0][1])) and proof is not None and run.config is not None:
        now = proved_checks(run.config, proof)
        stored = [(str(check.verdict), check.value) for check in now if check.name == REGION]
    if not stored or math.isnan(stored[0][1]):
        return None
    return stored[0][0] == Verdict.CERTIFIED
