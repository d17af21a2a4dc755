"""The own states of named elements in a result, and its final state."""

from rbstab.elements.registry import OWN_STATES
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


def final_state(result: Result) -> dict[str, list[float]]:
    """Return the state of the body and of the elements at the end, by the names of its arrays."""
    body = ("orientation", "angular_velocity", "position", "velocity")
    names = (*body, *OWN_STATES, *own_states_of(result))
    return {name: result[name][-1].tolist() for name in names if name in result}
