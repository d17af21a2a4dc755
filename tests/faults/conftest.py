"""Commands that nothing disturbs, which the tests of kills and of full disks compare with."""

import functools
from collections.abc import Callable, Iterator

import pytest
from support.disturbed_commands import Undisturbed
from support.forked_commands import CommandServer


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], Undisturbed]]:
    """A function that returns the undisturbed run of a case; each case runs once."""
    with CommandServer(tmp_path_factory.mktemp("server")) as server:

        @functools.cache
        def run(name: str) -> Undisturbed:
            return Undisturbed(name, server, tmp_path_factory.mktemp("undisturbed"))

        yield run
