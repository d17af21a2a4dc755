"""Each thread caches its compiled objects by key, and drops those unused for longest."""

from support.hang_guard import within

from rbstab.integrate.heyoka import compile_cache as module
from rbstab.integrate.heyoka.compile_cache import compiled_once


class Maker:
    """A factory that counts the objects that it makes."""

    def __init__(self):
        self.made = 0

    def __call__(self):
        self.made += 1
        return object()


def in_a_new_thread(function):
    return within(60.0, function)


def test_what_was_not_used_for_long_is_dropped(monkeypatch):
    monkeypatch.setattr(module, "MAX_CACHED", 3)

    def uses():
        make = Maker()
        kept = compiled_once(0, make)
        for key in range(1, 10):
            compiled_once(key, make)
            assert compiled_once(0, make) is kept
        assert make.made == 10
        compiled_once(9, make)
        compiled_once(8, make)
        assert make.made == 10
        compiled_once(7, make)
        assert make.made == 11

    in_a_new_thread(uses)
