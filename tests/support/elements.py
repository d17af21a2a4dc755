"""Random elements of every kind that the program knows, made from the gains that each declares.

A new element in the registry needs nothing here, unless it has fields besides its name and gains,
or loses power without a gain that is declared to dissipate.
"""

from collections.abc import Callable
from dataclasses import MISSING, fields
from typing import Any, NamedTuple, cast

import numpy as np

from rbstab.elements.element import Element
from rbstab.elements.gravity import Gravity
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.soft_guards import RepellingGuard, StiffGuard
from rbstab.elements.inputs.loads import Input
from rbstab.elements.inputs.signals import Constant, Leg, Sine
from rbstab.elements.ligament import Ligament
from rbstab.elements.motors import (
    LaggedConnector,
    LaggedCouple,
    LaggedForce,
    LaggedTie,
    LimitedConnector,
    LimitedCouple,
    LimitedEmbeddedConnector,
    LimitedEmbeddedTie,
    LimitedForce,
    LimitedTie,
)
from rbstab.elements.registry import ELEMENTS, NAMED_ELEMENTS
from rbstab.elements.sliding import CrossingTie, LayeredTie, SlidingConnector
from rbstab.elements.spring import Spring

SCALES = {
    "N/m": 1000.0,
    "N s/m": 100.0,
    "N m/rad": 100.0,
    "N m s/rad": 10.0,
    "m": 1.0,
    "rad": 0.5,
    "1": 0.1,
}
"""The size of a random gain by its unit; 100 for any other unit."""


INPUTS = tuple(kind for kind in NAMED_ELEMENTS if issubclass(kind, Input))
"""The elements that supply power."""


def random_spd(rng, scale=1.0):
    """Return a symmetric positive definite 3x3 matrix that is far from diagonal."""
    root = rng.normal(size=(3, 3))
    return scale * (root @ root.T + 0.5 * np.eye(3))


def random_gain(rng, gain):
    """Return a random value of the shape and the definiteness that a gain declares."""
    scale = SCALES.get(gain.unit, 100.0)
    if gain.shape == "matrix":
        if gain.positive:
            return random_spd(rng, scale)
        matrix = scale * rng.normal(size=(3, 3))
        return matrix + matrix.T
    if gain.shape == "direction":
        vector = rng.normal(size=3)
        return vector / np.linalg.norm(vector)
    size = 3 if gain.shape == "diagonal" else None
    values = scale * (rng.uniform(0.5, 2.0, size) if gain.positive else rng.normal(size=size))
    return values if size else float(values)


class Form(NamedTuple):
    """One way to fill the fields of an element that are not declared gains.

    Attributes:
        name: For the ids of tests; empty for the only form of an element.
        fields: Makes random values of these fields.
        has_potential: Whether `stored` is the potential of the element's force.
        loses: Whether it loses power while anything moves; by default, whether one of its gains is
            declared to dissipate.
        step: A factor of the steps of differences: a pole close by needs small ones.
    """

    name: str = ""
    fields: Callable[[np.random.Generator], dict[str, Any]] = lambda _: {}
    has_potential: bool = True
    loses: bool | None = None
    step: float = 1.0


def _weight(rng):
    return {"weight": rng.normal(size=3) * 100}


def _sliding(slides, layered):
    """Return what makes the surface, and the modes outside a layer or inside it."""

    def made(rng):
        layer = np.full(3, float(layered))
        return {
            "rate_weight": float(slides),
            "slope": float(rng.uniform(2, 20)) if slides else 1.0,
            "mode": rng.choice([-1.0, 1.0], size=3) * (1 - layer),
            "layer": layer,
            "layer_width": float(rng.uniform(0.5, 2)),
        }

    return made


def _with_signal(signal):
    """Return what makes an input with a random signal."""
    return {"fields": lambda rng: {"signal": signal(rng)}, "has_potential": False}


INPUT_FORMS = (
    Form("constant", **_with_signal(lambda _: Constant())),
    Form("sine", **_with_signal(lambda rng: Sine(*rng.uniform(0.5, 2.0, size=2).tolist()))),
    Form("leg", **_with_signal(lambda rng: Leg(*rng.normal(size=3).tolist()))),
)
"""The forms of an input: one for each formula of a signal."""


def _tie(*modes):
    """Return a form of a sliding tie on s = E, with its axes on each side and in a layer."""
    surface = {"rate_weight": 0.0, "slope": 1.0, "layer_width": 0.7}
    fields = {"mode": np.array(modes, dtype=float)} | surface
    return Form(fields=lambda _: fields)


def _in_modes(step, *modes):
    """Return a form of an element that switches: in given modes, and undamped in the first."""
    fields = {"mode": np.array(modes, dtype=float)}
    return Form(str(modes), lambda _: fields, loses=step < 1 and modes[0] > 0, step=step)


def _motor(*gains, lags, step=0.2, **named):
    """Return a form of a motor: its K and L are diagonal, and its lag leaves damping."""

    def made(rng):
        K, L = (np.diag(scale * rng.uniform(0.5, 2.0, 3)) for scale in (100.0, 10.0))
        return dict(zip(gains, (K, L), strict=True)) | ({"lag": 0.02} if lags else {}) | named

    return Form(fields=made, step=1.0 if lags else step)


MOTORS: dict[type[Element], tuple[Form, ...]] = {
    LimitedForce: (_motor("K_t", "L_t", lags=False),),
    LimitedCouple: (_motor("K_r", "L_r", lags=False),),
    LimitedTie: (_motor("K_c", "L_c", lags=False, name="one"),),
    LaggedForce: (_motor("K_t", "L_t", lags=True),),
    LaggedCouple: (_motor("K_r", "L_r", lags=True),),
    LaggedTie: (_motor("K_c", "L_c", lags=True, name="one"),),
    LimitedConnector: (_motor("K_c", "L_c", lags=False),),
    LaggedConnector: (_motor("K_c", "L_c", lags=True),),
    LimitedEmbeddedConnector: (_motor("K_c", "L_c", lags=False, step=0.02),),
    LimitedEmbeddedTie: (_motor("K_c", "L_c", lags=False, step=0.02, name="one"),),
}
"""The passive motors."""

FORMS: dict[type[Element], tuple[Form, ...]] = {
    **MOTORS,
    Gravity: (Form(fields=_weight),),
    SlidingConnector: (
        Form("s = E", _sliding(slides=False, layered=False)),
        Form("s = E in its layer", _sliding(slides=False, layered=True)),
        Form("s = F + κE", _sliding(slides=True, layered=False), has_potential=False),
        Form("s = F + κE in its layer", _sliding(slides=True, layered=True), has_potential=False),
    ),
    Spring: (Form(loses=True, step=0.2),),
    Barrier: (Form(step=0.1),),
    **dict.fromkeys(INPUTS, INPUT_FORMS),
    CrossingTie: (_tie(1, 0, 1),),
    LayeredTie: (_tie(1, 0, 0, 0, 1, 0),),
    Ligament: tuple(_in_modes(0.1, *modes) for modes in [(0, 0), (1, 0), (1, 1)]),
    StiffGuard: tuple(_in_modes(1.0, *modes) for modes in [(0, 0), (1, 0), (0, 1)]),
    RepellingGuard: tuple(_in_modes(1.0, *modes) for modes in [(0, 0), (1, 0), (0, 1)]),
}
"""The forms of the elements with fields that are not declared gains."""


def forms_of(kind):
    """Return the forms of an element."""
    return FORMS.get(kind, (Form(),))


SMOOTH = tuple(kind for kind in NAMED_ELEMENTS if not kind.mode_count and not kind.supplies)
"""The named elements that are passive and do not switch; the others have tests of their own."""

CASES = [(kind, form) for kind in (*ELEMENTS, *SMOOTH, *MOTORS) for form in forms_of(kind)]
"""Every passive smooth element in each of its forms."""

SWITCHING_CASES = [
    (kind, form)
    for kind in (CrossingTie, LayeredTie, Ligament, StiffGuard, RepellingGuard)
    for form in forms_of(kind)
]
"""Elements that switch, in each of their modes."""

INPUT_CASES = [(kind, form) for kind in INPUTS for form in forms_of(kind)]
"""Every input with each formula of a signal."""


def case_id(case):
    """Return the id of a case in the names of tests."""
    kind, form = case
    return f"{kind.__name__} {form.name}".rstrip()


def random_element(rng, kind, form=None):
    """Return a random element in one of its forms, by default in the first."""
    declared = fields(cast("Any", kind))
    values = {"name": "one"} if any(field.name == "name" for field in declared) else {}
    values |= {gain.name: random_gain(rng, gain) for gain in kind.gains}
    values |= (form or forms_of(kind)[0]).fields(rng)
    missing = [f.name for f in declared if f.default is MISSING and f.name not in values]
    assert not missing, f"{kind.__name__}: no declared gains, add them to `FORMS`: {missing}"
    return kind(**values)
