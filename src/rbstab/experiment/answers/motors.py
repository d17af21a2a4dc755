"""Whether the motors of a config are passive, and what is known of those that are not."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from rbstab.analysis.exact import decimals, is_positive_definite
from rbstab.config.build import system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import without_code
from rbstab.elements.motors import Hard, Lagged, Motor
from rbstab.elements.registry import longest_lag
from rbstab.experiment.along.locus import linearised_at_rest
from rbstab.experiment.answers.rest_modes import GROWS
from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.answers.state_words import angles
from rbstab.experiment.answers.words import Sureness

SYMBOLS = {"translational stabilizer": "H", "rotational stabilizer": "N"}

BODY_AXES = "not passive: its limit acts in body axes. What it supplies is audited, not bounded"


HARD = ". Beyond its hard limit it damps nothing: proofs need other dampers, or law: smooth"


class MotorAnswer(NamedTuple):
    """What is known of a motor.

    Attributes:
        name: H, N, or the name of a tie.
        passive: Whether it is passive, proved.
        longest_lag: The lag up to which it is, s; None for a limit.
        sureness: How sure it is that the body is stable, or not, if it is not passive.
        sentence: A sentence without a full stop.
        orientation: Θ of the rest state whose eigenvalues tell this, rad, shape (3,); else None.
    """

    name: str
    passive: bool
    longest_lag: float | None
    sureness: Sureness
    sentence: str
    orientation: tuple[float, ...] | None = None

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return self._asdict()

    def __str__(self) -> str:
        return f"Motor {self.name}: {self.sentence}"


def motor_answers(config: Config) -> list[MotorAnswer]:
    """Return what is known of each motor of a config. No code of users runs."""
    return [*_answers(config)]


def _answers(config: Config) -> Iterator[MotorAnswer]:
    exact = system_of(without_code(config), decimals)
    for motor in exact.elements:
        if not isinstance(motor, Motor):
            continue
        name, passive, bound = SYMBOLS.get(motor.name, motor.name), not motor.supplies, None
        Theta = None
        sureness = Sureness.PROVED if passive else Sureness.NOT_DECIDED
        said = "its limit keeps it passive, proved" if passive else BODY_AXES
        said += HARD if isinstance(motor, Hard) else ""
        if isinstance(motor, Lagged):
            passive = passive and is_positive_definite(motor.left)
            bound = longest_lag(*(matrix.astype(float) for matrix in motor.matrices))
            least = f"{_border(bound, float(motor.lag))} s, the least eigenvalue of K⁻¹L"
            border = (
                f"its lag is below {least}" if bound < math.inf else "K is 0, so its lag may be any"
            )
            said = f"{border}: passive, proved"
            if not passive:
                sureness, stable, Theta = _by_eigenvalues(config)
                said = f"its lag is not below {least}: not passive, nothing is proved. {stable}"
        yield MotorAnswer(name, passive, bound, sureness, said, Theta)


def _border(bound: float, lag: float) -> str:
    """Return the longest lag rounded down, with enough digits to be above a shorter lag."""
    texts = [rounded_down(bound, digits) for digits in range(4, 18)]
    return next((text for text in texts if float(text) > lag), texts[0])


def _by_eigenvalues(config: Config) -> tuple[Sureness, str, tuple[float, ...] | None]:
    """Return what the eigenvalues at rest say of a body, and Θ of this rest state."""
    _, linear, Theta = linearised_at_rest(config)
    if linear is None or Theta is None:
        return Sureness.NOT_DECIDED, "No rest state is found", None
    slowest, size = linear.eigenvalues[0].real, abs(linear.eigenvalues).max()
    by = f"by the eigenvalues at the rest state Θ = {angles(Theta)} rad"
    if abs(slowest) <= GROWS * size:
        return Sureness.NOT_DECIDED, f"Not decided {by}", Theta
    word = "unstable" if slowest > 0 else "stable"
    text = f"The body is {word} {by} (largest Re λ = {slowest:.4g} 1/s): seen"
    return Sureness.SEEN, text, Theta
