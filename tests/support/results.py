"""A small result to store, with the numbers that a file format loses most easily."""

import hashlib
from dataclasses import replace

import numpy as np

from rbstab.store.disk.seal import FORMAT
from rbstab.store.result import Result
from rbstab.store.variables import Variable

AWKWARD = [0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 1.7976931348623157e308, 0.1, -1 / 3]


def result(seed=0, samples=5) -> Result:
    """Return a result with random arrays; seeds change the numbers, not the sizes."""
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(samples, 3))
    vectors.flat[: len(AWKWARD)] = AWKWARD[: vectors.size]
    parts = np.array(["kinetic", "Feder µ", "連結"], dtype=object)
    variables = {
        "axis": Variable(("axis",), np.array([1, 2, 3]), "1", "component of a vector"),
        "part": Variable(("part",), parts, "1", "part of the system"),
        "time": Variable(("time",), np.linspace(0, 1, samples), "s", "t: time"),
        "orientation": Variable(("time", "axis"), vectors, "rad", "Θ: angles"),
        "energy": Variable(("time", "part"), rng.normal(size=(samples, 3)), "J", "-: energy"),
        "lyapunov": Variable(("time",), rng.normal(size=samples), "J", "v: ∫v'dt"),
        "energy_at_rest": Variable((), np.array(-1e-300), "J", "-h: at rest"),
    }
    attributes: dict[str, str | int | float] = {
        "title": "Fall 2 – θ",
        "status": "completed",
        "status_detail": "",
        "run_id": f"{seed:032x}",
        "engine": "scipy",
        "steps": 2**40 + seed,
        "wall_time": 0.1,
    }
    return Result(variables, attributes, f"title: Fall 2 – θ\nseed: {seed}\n")


def with_data(result, name, data):
    """Return a result with other data in an array; the arrays themselves are read-only."""
    changed = {name: result.variables[name]._replace(data=data)}
    return replace(result, variables=result.variables | changed)


def sealed(content):
    """Return content with a right seal: anybody can make one, as it is no signature."""
    digest = hashlib.sha256(content).hexdigest()
    return content + f"\nrbstab format {FORMAT:03d} sha256 {digest}\n".encode()


def assert_equal(actual, expected):
    """Assert that two results are bitwise equal, with names, order, units and texts."""
    assert list(actual.variables) == list(expected.variables)
    for name, variable in expected.variables.items():
        other = actual.variables[name]
        assert other.dimensions == variable.dimensions, name
        assert (other.unit, other.long_name) == (variable.unit, variable.long_name), name
        assert other.data.dtype == variable.data.dtype, name
        assert other.data.shape == variable.data.shape, name
        if variable.data.dtype == object:
            assert other.data.tolist() == variable.data.tolist(), name
        else:
            assert other.data.tobytes() == variable.data.tobytes(), name
    assert actual.attributes == expected.attributes
    kinds = {name: type(value) for name, value in actual.attributes.items()}
    assert kinds == {name: type(value) for name, value in expected.attributes.items()}
    assert actual.config == expected.config


def flip(path, share=0.5):
    """Change a bit of a file, at this share of its size."""
    content = bytearray(path.read_bytes())
    content[int(share * len(content))] ^= 1
    path.write_bytes(content)
    return path


def cut(result, samples):
    """Return a result that ended early, after so many samples."""
    variables = {
        name: v._replace(data=v.data[:samples]) if v.dimensions[:1] == ("time",) else v
        for name, v in result.variables.items()
    }
    return replace(result, variables=variables)
