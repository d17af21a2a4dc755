"""The tolerances within which the table says what is proved of all bodies."""

from support.claims.program import within_of
from support.claims.table import config_of

_OF_ALL = tuple((f"controller=±{percent}%",) for percent in (10, 20, 30, 40))
_WITH_POINT = (
    ("controller=±5%", "body.contact_point=±0.005"),
    ("controller=±20%", "body.contact_point=±0.01"),
)
_FREE = ("case1_permanent", "case2_visco_elastic", "case3_embedded")
_GUARDED = ("case1_guarded", "case2_guarded", "case3_guarded")

WITHIN: dict[str, tuple[tuple[str, ...], ...]] = {
    **{f"configs/paper/{case}.yaml": (*_OF_ALL, *_WITH_POINT) for case in _FREE},
    **{f"configs/paper/{case}.yaml": (("controller=±20%",),) for case in _GUARDED},
    "configs/examples/strut_proved.yaml": (("controller=±5%",),),
}
"""The tolerances, by config."""

LIMIT = 30.0
"""s, CPU time of each of them."""


def within(name):
    """Return what is proved within the tolerances of a config."""
    config = config_of(name)
    return {", ".join(texts): within_of(config, texts, LIMIT) for texts in WITHIN[name]}
