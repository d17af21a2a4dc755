"""Protects reads of many files by several processes: all, in order, also if one is killed."""

import os

import pytest

from rbstab.processes import mapped as module
from rbstab.processes.mapped import mapped

COUNT = 40


@pytest.fixture
def two_processors(monkeypatch):
    monkeypatch.setattr(module, "processor_count", lambda: 2)
    monkeypatch.setattr(module, "PER_WORKER", COUNT // 2)


def with_process(number):
    return number, os.getpid()


def killed_in_a_worker(item):
    number, parent, last = item
    if os.getpid() != parent and number == last:
        os._exit(1)
    return number


def refused(number):
    if number == COUNT - 1:
        raise ZeroDivisionError(number)
    return number


def test_many_items_are_shared(two_processors):
    numbers, processes = zip(*mapped(with_process, range(COUNT)), strict=True)
    assert numbers == tuple(range(COUNT))
    assert os.getpid() not in processes


@pytest.mark.parametrize("count", [0, 1, COUNT - 1])
def test_few_items_need_no_process(two_processors, count):
    assert list(mapped(with_process, range(count))) == [(n, os.getpid()) for n in range(count)]


@pytest.mark.parametrize("last", [0, COUNT // 2, COUNT - 1])
def test_a_killed_worker_loses_nothing(two_processors, last):
    items = [(number, os.getpid(), last) for number in range(COUNT)]
    assert list(mapped(killed_in_a_worker, items)) == list(range(COUNT))


def test_the_error_of_an_item_is_raised(two_processors):
    results = mapped(refused, range(COUNT))
    with pytest.raises(ZeroDivisionError):
        list(results)
