"""What a report says about the stability of a run, found where the run is read."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from rbstab.analysis.certificate import Check, Verdict
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code
from rbstab.experiment.answers.run_answer import RunAnswer, answer_beside
from rbstab.experiment.run_certificate import CERTIFIED_REGION, proved_checks
from rbstab.experiment.stored_certificate import CertificateLine, certificate_lines
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.store.result import Result


class Answers(NamedTuple):
    """The answers about a run.

    Attributes:
        answer: What is known about stability, and how surely.
        inside: Whether the run starts in its certified region; None if unknown.
        margin: v(0) over the level of this region, both from its rest state; None if unknown. (The
            stored v may count from another rest state, which the motion approaches.)
    """

    answer: RunAnswer
    inside: bool | None
    margin: float | None


def answers_of(result: Result, config: Config | None, proof: Proof | None) -> Answers:
    """Return the answers about a run, with a proof that may have been stored after it.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it.
        proof: The proof that is stored in the same folder, if there is one.
    """
    lines = certificate_lines(result)
    checks = _checks(lines, config, proof)
    return Answers(answer_beside(result, config, proof, checks), *_region(lines, checks))


def _checks(
    lines: Sequence[CertificateLine], config: Config | None, proof: Proof | None
) -> list[Check] | None:
    """Return what a proof decides that was stored after a run.

    None if the certificate has it already, or if it cannot be computed.
    """
    stored = [line.value for line in lines if line.check == CERTIFIED_REGION]
    if (stored and not math.isnan(stored[0])) or proof is None:
        return None
    # The regions would need the equations, and a stored result must not run code of a user.
    if config is None or has_code(config):
        return None
    return proved_checks(problem_of(config), proof)


def _region(
    lines: Sequence[CertificateLine], checks: Sequence[Check] | None
) -> tuple[bool | None, float | None]:
    """Return whether a run starts in its certified region, and the margin; None if unknown.

    The certificate decides. If it was written without a proof, a proof stored since then decides.
    """
    found = [(line.verdict, line.value, line.bound) for line in lines if _is_region(line.check)]
    if checks is not None:
        found = [(str(one.verdict), one.value, one.bound) for one in checks if _is_region(one.name)]
    if not found or math.isnan(found[0][1]):
        return None, None
    verdict, start, level = found[0]
    return verdict == Verdict.CERTIFIED, start / level if 0 < level < math.inf else None


def _is_region(name: str) -> bool:
    """Return whether a check is that of the certified region."""
    return name == CERTIFIED_REGION
