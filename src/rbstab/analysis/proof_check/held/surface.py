"""Check a rest state at which an element of a user holds the body: where its force jumps, at h = 0.

F is U without the part max(h, 0), or min(h, 0). The state is at rest where h = 0 and ∇F + λ∇h = 0
for some λ between 0 and 1: four equations for Θ and λ, with the symmetric matrix

    J = [[∇²F + λ∇²h, ∇h], [∇h', 0]].
"""

from functools import cache, cached_property
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.claims import RestState, fault_of
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.findings import Range
from rbstab.analysis.proof_check.formulas.kinks import Kink, KinkOver
from rbstab.analysis.proof_check.held.angle import index_of_two
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import Ball

REACH = 4
"""λ is looked for in an interval so many times as wide as that of angles, in their unit."""


def surface_of(U: Energy, box: Box) -> Kink | None:
    """Return the only kink that may jump in a box; None if there is none, or more than one."""
    jumping = Taylor(U, box).jumping
    return jumping[0].kink if len(jumping) == 1 else None


def surface_fault(U: Energy, state: RestState, range_: Range) -> str | None:
    """Return what is wrong with a rest state on the surface of a kink."""

    @cache
    def equations() -> _Equations | None:
        """Return the equations; only an enclosure inside the range is expanded."""
        kink = surface_of(U, state.enclosure)
        return None if kink is None else _Equations(U, state.enclosure, kink)

    def unique() -> bool:
        found = equations()
        return found is not None and found.unique

    def exists() -> bool:
        found = equations()
        return found is not None and found.has_zero(state.enclosure)

    def index() -> int | None:
        found = equations()
        return None if found is None else found.index

    fault = fault_of(state, range_, unique=unique, exists=exists, index=index)
    found = equations()
    if fault is None and found is not None and found.ridge != state.ridge:
        does, said = ("pushes away from", "no") if found.ridge else ("pulls back to", "a")
        return f"the force {does} the surface, but it is stored as {said} ridge"
    return fault


def unique_on_surface(U: Energy, kink: Kink, box: Box) -> bool:
    """Return whether a box has at most one rest state, as it would be on the surface of a kink."""
    return _Equations(U, box, kink).unique


class _Equations:
    """The four equations over a box, for all λ that may solve them.

    Args:
        U: The energy.
        box: The box.
        kink: The part that jumps.
    """

    def __init__(self, U: Energy, box: Box, kink: Kink) -> None:
        self.others, self.ridge = Taylor(U, box, without=kink), kink.ridge
        self.argument = KinkOver(kink, self.others.centre, self.others.step.entries()).argument
        self.normal = [entry.mid() for entry in self.argument.gradient]
        sizes = [abs(float(entry)) for entry in self.normal]
        stiffness = max(abs(float(one.mid())) for one in self.others.hessian.entries())
        self.unit = arb(stiffness / max(sizes)) if max(sizes) > 0 else arb("nan")

    @cached_property
    def share(self) -> Ball:
        """λ for all zeros in the box, from n'∇F + λn'∇h = 0 with n = ∇h at the centre."""
        n, F = arb_mat([self.normal]), self.others
        pressing = (n * F.gradient)[0, 0] + ((n * F.slope) * F.step)[0, 0]
        along = sum((n[0, i] * self.argument.slopes[i] for i in AXES), arb(0))
        return -pressing / along if along > 0 else arb("nan")

    @property
    def balanced(self) -> bool:
        """Whether all λ are strictly between 0 and 1: nothing is at rest beside the surface."""
        return bool(self.share > 0) and bool(self.share < 1)

    def jacobian(self, share: Ball) -> Any:
        """Return J over the box, with the last row and column times `unit`."""
        block = self.others.whole_hessian + share * self.argument.hessian
        border = [self.unit * entry for entry in self.argument.slopes]
        rows = [[*(block[i, j] for j in AXES), border[i]] for i in AXES]
        return arb_mat([*rows, [*border, arb(0)]])

    @cached_property
    def inverse(self) -> Any:
        """A matrix near J⁻¹; None if there is none."""
        try:
            found = self.jacobian(self.share.mid()).mid().inv().mid()
        except ZeroDivisionError:
            return None
        return found if all(entry.is_finite() for entry in found.entries()) else None

    def _deviation(self, share: Ball) -> Any:
        """Return I - YJ."""
        unit = arb_mat([[arb(int(i == j)) for j in range(4)] for i in range(4)])
        return unit - self.inverse * self.jacobian(share)

    @property
    def unique(self) -> bool:
        """Whether the equations are one to one over the box, for all λ that may solve them."""
        if not self.balanced or self.inverse is None:
            return False
        found = self._deviation(self.share)
        rows = (sum((found[i, j].abs_upper() for j in range(4)), arb(0)) for i in range(4))
        return all(total < 1 for total in rows)

    def has_zero(self, box: Box) -> bool:
        """Return whether Krawczyk's test finds a zero in the box, with λ between 0 and 1."""
        if self.inverse is None:
            return False
        F, h, middle = self.others, self.argument, self.share.mid()
        reach = REACH * max(float(entry.rad()) for entry in F.step.entries())
        share = middle + self.unit * arb(0, reach)
        step = arb_mat([*([entry] for entry in F.step.entries()), [arb(0, reach)]])
        rows = [[F.gradient[i, 0] + middle * h.gradient[i]] for i in AXES]
        values = arb_mat([*rows, [self.unit * h.value]])
        image = self._deviation(share) * step - self.inverse * values
        inside = all(
            arb(low) < F.centre[i] + image[i, 0] < arb(high) for i, (low, high) in enumerate(box)
        )
        within = bool(image[3, 0].abs_upper() < reach)
        return inside and within and bool(share > 0) and bool(share < 1)

    @property
    def index(self) -> int | None:
        """The number of directions of descent; None if not known.

        It is that of the negative eigenvalues of ∇²F + λ∇²h along the surface. On a ridge it is one
        more: U falls on both sides.
        """
        n = self.argument.slopes
        axis = min(AXES, key=lambda i: abs(float(n[i].mid())))
        first = _cross(n, [arb(int(i == axis)) for i in AXES])
        along = arb_mat([first, _cross(n, first)])
        L = self.others.whole_hessian + self.share * self.argument.hessian
        H = along * L * along.transpose()
        along_surface = index_of_two(H[0, 0], (H[0, 1] + H[1, 0]) / 2, H[1, 1])
        return None if along_surface is None else along_surface + int(self.ridge)


def _cross(a: list[Ball], b: list[Ball]) -> list[Ball]:
    """Return the vector product."""
    return [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in AXES]
