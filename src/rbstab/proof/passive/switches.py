"""The switches of an element of a user: its energy is continuous there, and so may its force be.

With σ_i = 1 where the event function g_i is positive, and else 0, E = E₀ + Σ σ_i T_i. Each T_i must
be zero where g_i is; so E is continuous. If ∇T_i is zero there too, the force is. Else it jumps: on
the surface ∇T_i = k_i ∇g_i, and k_i = ∇T_i·∇g_i/|∇g_i|² must have one sign. If it is never below
zero, the force pulls back to the surface, and E has a valley there; if never above, E has a ridge.
"""

from collections.abc import Sequence
from itertools import product

from rbstab.proof.exact.atoms import LET, VAR, Atom
from rbstab.proof.exact.expr import Expr, expr, mapped, only, same_function, summed
from rbstab.proof.exact.rewriting import derivative, substituted
from rbstab.proof.passive.expanded import is_zero
from rbstab.proof.passive.signs import never_negative
from rbstab.proof.passive.statements import Statements

MOST_MODES = 6
"""The most switches of one element: a guard on both sides of each angle has so many."""

NOT_OF_ANGLES = (
    "it switches, and its energy or an event function depends on more than Θ (and, for the energy, "
    "its own states, or its own states and X)"
)

NOT_CONTINUOUS = (
    "it is not shown that `stored` is continuous at its switches: each of its terms with a mode "
    "must have just one mode, and be zero where its event function is, as with this or its square "
    "as another factor"
)

SIGN_UNKNOWN = (
    "its force jumps at a switch, and it is not seen from `stored` whether it pulls back to it or "
    "pushes away from it everywhere (whether the factor of the mode and its event function is "
    "never negative, or never positive)"
)

JUMPS_BY_MORE = (
    "its force jumps at a switch, and the factor of the mode and its event function in `stored` "
    "depends on more than Θ"
)


def why_not_continuous(statements: Statements) -> str | None:
    """Return what is not shown of the switches of an element; None if all is."""
    if not statements.modes:
        return None
    of, Theta = statements.of_motion, set(range(3))
    others = of.stored.variables.difference(Theta, *(a.variables for a in statements.modes))
    if any(not g.variables <= Theta for g in of.guards) or (
        others and not statements.state_numbers
    ):
        return NOT_OF_ANGLES
    smooth = _smooth(statements)
    if smooth is None:
        return NOT_CONTINUOUS
    parts = _parts(of.guards, of.stored, statements.modes)
    jumps = [T for continuous, (_, T) in zip(smooth, parts, strict=True) if not continuous]
    if not all(T.variables <= Theta for T in jumps):
        return JUMPS_BY_MORE
    return SIGN_UNKNOWN if None in smooth else None


def force_is_continuous(statements: Statements) -> bool:
    """Return whether the force is continuous at all switches, of which all else is shown."""
    smooth = _smooth(statements)
    return smooth is not None and all(smooth)


def _smooth(statements: Statements) -> list[bool | None] | None:
    """Return whether the force is continuous at each surface; None if E is not shown to be."""
    # It is looked for in functions of the entries of a motion, and in those of q.
    forms = (statements.of_any, statements.of_motion)
    both = [_parts(of.guards, of.stored, statements.modes) for of in forms]
    candidates = [
        [_is_smooth(g, T) for g, T in parts]
        for parts in both
        if len(parts) == len(both[1]) > 0 and all(_vanishes(T, g) for g, T in parts)
    ]
    # An entry is None if the sign of the force at its surface is not seen.
    return min(candidates, key=lambda smooth: smooth.count(None), default=None)


def _parts(guards: Sequence[Expr], stored: Expr, modes: Sequence[Atom]) -> list[tuple[Expr, Expr]]:
    """Return each g_i with its T_i, one for each surface; nothing if E is not of this form."""
    numbers = frozenset[int]().union(*(a.variables for a in modes))
    sums = [stored, *(a.inner for a in stored.all_atoms if a.kind == LET)]
    factors = {factor for e in sums for m in e.terms for factor in m if factor[0] not in modes}
    if any((a.kind != LET or p < 0) and a.variables & numbers for a, p in factors):
        return []

    def with_modes(*values: int) -> Expr:
        return substituted(stored, dict(zip(modes, map(expr, values), strict=True)))

    units = [[int(j == k) for j in range(len(modes))] for k in range(len(modes))]
    E = with_modes(*(0 for _ in modes))
    differences = [with_modes(*unit) - E for unit in units]
    for values in product((0, 1), repeat=len(modes)):
        both = [T for T, value in zip(differences, values, strict=True) if value]
        if len(both) > 1 and not is_zero(summed((E, *both, -with_modes(*values)))):
            return []
    parts: dict[Expr, Expr] = {}
    for g, T in zip(guards, differences, strict=True):
        if -g in parts:  # step(-g) = 1 - step(g)
            parts[-g] = parts[-g] - T
        else:
            parts[g] = parts.get(g, expr(0)) + T
    return list(parts.items())


def _is_smooth(g: Expr, T: Expr) -> bool | None:
    """Return whether the force is continuous at one surface; None if its sign is not seen."""
    variables = [{k: expr(1)} for k in sorted(T.variables | g.variables)]
    slopes = [derivative(T, direction) for direction in variables]
    if all(_vanishes(slope, g) for slope in slopes):
        return True
    share = summed(
        derivative(g, direction) * slope for direction, slope in zip(variables, slopes, strict=True)
    )
    on_surface = _on_surface(share, g)
    return False if any(never_negative(e) or never_negative(-e) for e in on_surface) else None


def _vanishes(e: Expr, g: Expr) -> bool:
    """Return whether an expression is shown to be zero wherever another one is."""
    return any(map(is_zero, _on_surface(e, g)))


def _on_surface(e: Expr, g: Expr) -> list[Expr]:
    """Return forms of an expression where g = 0: a term a^n of g stands for all others."""
    forms = [e]
    for m, c in g.terms.items():
        rest = (Expr({m: c}) - g).scaled(1 / c)
        if len(m) == 1 and m[0][0] not in rest.all_atoms:
            forms.append(_with_power(e, *m[0], rest))
    return forms


def _with_power(e: Expr, a: Atom, n: int, rest: Expr) -> Expr:
    """Put an expression in place of a^n."""

    def change(b: Atom, p: int) -> Expr:
        if b is a:
            return rest ** (p // n) * only(a) ** (p % n)
        inside = b.kind != VAR and a in b.inner.all_atoms
        return (same_function(b, _with_power(b.inner, a, n, rest)) if inside else only(b)) ** p

    return mapped(e, change)
