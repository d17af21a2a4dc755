"""U of all bodies in a box as one form plus forms with unknown weights in [-1, 1].

Each power of z is written in Chebyshev polynomials, which lie in [-1, 1]: z² = ½ + ½ c_2(z).
Products of these with the same form in Θ, up to a factor, are taken together: the magnitudes of the
factors add up.
"""

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, Any

from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
from rbstab.analysis.proof.robust.elimination import Eliminated
from rbstab.analysis.proof.robust.family import FormFamily

if TYPE_CHECKING:
    from flint import fmpq

Term = tuple[int, ...]
"""The powers of a term in the order of `Ring.context`, without those of z."""

Degrees = tuple[int, ...]
"""The degree of the Chebyshev polynomial in each z."""


@dataclass
class _Shared:
    """A form in Θ that occurs with several functions of z.

    factor is the sum of the magnitudes of its factors, and by_variable the sum of those that depend
    on each z.
    """

    terms: "dict[Term, fmpq]"
    factor: "fmpq"
    by_variable: "dict[int, fmpq]" = field(default_factory=dict)


def family_of(reduced: Eliminated) -> FormFamily:
    """Return the energies of all bodies in a box, each up to a constant, as one family of forms.

    Raises:
        NoReducedEnergy: The energy has a term that a form cannot contain.
    """
    from flint import fmpq  # imported late, as in `polynomial`

    ring = reduced.energy.ring
    by_degrees = in_chebyshev(reduced.energy)
    middle = by_degrees.pop((0,) * ring.parameters, {})
    shared: dict[Any, _Shared] = {}
    for degrees, terms in by_degrees.items():
        places = {place for place, degree in enumerate(degrees) if degree}
        _add(shared, terms, fmpq(1), places)
    for size, polynomial, variables in reduced.remainders:
        for degrees, terms in in_chebyshev(polynomial).items():
            places = {place for place, degree in enumerate(degrees) if degree}
            _add(shared, terms, fmpq(size.numerator, size.denominator), places | variables)
    try:
        centre = form_of(_polynomial(ring, middle))
        others = [
            form_of(_polynomial(ring, {term: one.factor * x for term, x in one.terms.items()}))
            for one in shared.values()
        ]
    except NotTrigonometric as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC) from error
    shares = tuple(
        tuple(
            float(_as_fraction(one.by_variable.get(place, fmpq(0)) / one.factor))
            for place in range(ring.parameters)
        )
        for one in shared.values()
    )
    return FormFamily(
        centre.quadratic, centre.linear, centre.coefficients, others=tuple(others), shares=shares
    )


def in_chebyshev(polynomial: Polynomial) -> "dict[Degrees, dict[Term, fmpq]]":
    """Write a polynomial in Θ and z as Σ c_d(z) P_d(Θ), with products c_d of c_k(z_i)."""
    ring = polynomial.ring
    cut = 3 * ring.angles + ring.lengths
    by_powers: dict[Degrees, dict[Term, Any]] = {}
    for powers, coefficient in polynomial.terms():
        by_powers.setdefault(powers[cut:], {})[powers[:cut]] = coefficient
    found: dict[Degrees, dict[Term, Any]] = {}
    for powers, terms in by_powers.items():
        factors = [chebyshev(power) for power in powers]
        for degrees in product(*factors):
            weight = Fraction(1)
            for factor, degree in zip(factors, degrees, strict=True):
                weight *= factor[degree]
            target = found.setdefault(degrees, {})
            p, q = weight.numerator, weight.denominator
            for term, coefficient in terms.items():
                target[term] = target.get(term, 0) + coefficient * p / q
    return found


@cache
def chebyshev(power: int) -> dict[int, Fraction]:
    """Return the weights of zⁿ in c_k, by k. They follow from z c_k = ½ (c_{k+1} + c_{k-1})."""
    if power == 0:
        return {0: Fraction(1)}
    found: dict[int, Fraction] = {}
    for degree, weight in chebyshev(power - 1).items():
        for target in (degree + 1, abs(degree - 1)):
            found[target] = found.get(target, Fraction(0)) + weight / 2
    return found


def _add(
    shared: dict[Any, _Shared], terms: "dict[Term, fmpq]", size: "fmpq", places: set[int]
) -> None:
    """Add a form with a weight of at most `size` to those that are proportional to it."""
    # A constant has no effect on rest states, nor on differences of energies of the same body.
    left = {term: x for term, x in sorted(terms.items()) if x != 0 and any(term)}
    if not left:
        return
    lead = next(iter(left.values()))
    scaled = {term: x / lead for term, x in left.items()}
    key = tuple((term, int(x.p), int(x.q)) for term, x in scaled.items())
    factor = abs(lead) * size
    one = shared.setdefault(key, _Shared(scaled, 0 * factor))
    one.factor += factor
    for place in places:
        one.by_variable[place] = one.by_variable.get(place, 0 * factor) + factor


def _polynomial(ring: Any, terms: "dict[Term, fmpq]") -> Polynomial:
    whole = {(*term, *[0] * ring.parameters): coefficient for term, coefficient in terms.items()}
    return Polynomial(ring, ring.context.from_dict(whole))


def _as_fraction(number: "fmpq") -> Fraction:
    return Fraction(int(number.p), int(number.q))
