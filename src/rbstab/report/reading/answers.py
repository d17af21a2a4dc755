"""What a report says about the stability of a run, found where the run is read."""

import math
from typing import NamedTuple

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.config.schema import Config
from rbstab.experiment.answers.run_answer import RunAnswer, answer_of
from rbstab.experiment.convergence.convergence import Convergence, stored_convergence
from rbstab.experiment.convergence.with_proof import with_later_proof
from rbstab.experiment.run_certificate import CERTIFIED_REGION
from rbstab.experiment.stored_certificate import certificate_lines
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.store.result import Result


class RegionCheck(NamedTuple):
    """The check of a start against its certified region.

    Attributes:
        inside: Whether the run starts inside.
        start: v(0) from the rest state of the region, J. (The stored v may count from another rest
            state, which the motion approaches.)
        level: The level of the region, J.
    """

    inside: bool
    start: float
    level: float


class Answers(NamedTuple):
    """The answers about a run, from the result and the proof that lies beside it now.

    Attributes:
        answer: What is known about stability, and how surely.
        lines: The checks of its certificate, also those that a later proof decides.
        convergence: What is proved of the exact motion; None for an older result.
        region: The check of the certified region; None if there is no region.
    """

    answer: RunAnswer
    lines: tuple[Check, ...]
    convergence: Convergence | None
    region: RegionCheck | None


def answers_of(result: Result, config: Config | None, proof: Proof | None) -> Answers:
    """Return the answers about a run, with a proof that may have been stored after it.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it.
        proof: The proof that is stored in the same folder, if there is one.
    """
    now = with_later_proof(result, config, proof)
    lines = tuple(certificate_lines(now))
    regions = [
        RegionCheck(line.verdict == Verdict.CERTIFIED, line.value, line.bound)
        for line in lines
        if line.check == CERTIFIED_REGION and not math.isnan(line.value)
    ]
    convergence = stored_convergence(now.attributes)
    return Answers(
        answer_of(now, config, proof), lines, convergence, regions[0] if regions else None
    )
