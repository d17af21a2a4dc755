"""The own states of named elements in the file of a run, which declares them itself."""

from rbstab.elements.declarations import OwnState
from rbstab.store.variables import Variable
from rbstab.systems.quantities import Quantity, state_quantity


def state_in_file(name: str, variable: Variable) -> Quantity:
    """Return the quantity that an array must be, if it is an own state of a named element."""
    size = variable.data.shape[1] if variable.data.ndim == 2 else 0
    symbol, _, meaning = variable.long_name.partition(": ")
    return state_quantity(OwnState(name, symbol, variable.unit, meaning, size))
