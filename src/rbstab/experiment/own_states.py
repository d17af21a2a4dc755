"""The own states of named elements in a result."""

from rbstab.store.result import Result
from rbstab.systems.quantities import is_element_state


def own_states_of(result: Result) -> tuple[str, ...]:
    """Return the names of the own states of named elements.

    The numbers of the entries of one, such as `cord.creep_component`, are an array too, but no own
    state: it is the scale of a dimension.
    """
    return tuple(
        name
        for name, variable in result.variables.items()
        if is_element_state(name) and variable.dimensions != (name,)
    )
