"""Functions for worker processes of `rbstab.processes.isolated`: they hang, crash and fail."""

import os
import re
import signal
import time


class TwoArgumentsError(Exception):
    """An exception that pickle cannot restore."""

    def __init__(self, first, second):
        super().__init__(f"{first}, {second}")


def double(number):
    return 2 * number


def process_of(_):
    return os.getpid()


def hang(seconds):
    """Hang in a call that lets other threads of Python run."""
    time.sleep(seconds)


def wait_and_return(seconds_and_value):
    seconds, value = seconds_and_value
    time.sleep(seconds)
    return value


def hang_all_threads(pid_file):
    """Write the number of this process to a file, and hang in a call that no thread can interrupt.

    A regular expression with exponential time stands for a library that loops for ever.
    """
    pid_file.write_text(str(os.getpid()))
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    re.match(r"(a+)+$", "a" * 60 + "b")


def write_pid_and_sleep(pid_file):
    pid_file.write_text(str(os.getpid()))
    time.sleep(600)


def crash(signal_number):
    os.write(2, b"corrupted size vs. prev_size\n")
    os.kill(os.getpid(), signal_number)


def leave(code):
    os._exit(code)


def take(size):
    return len(bytearray(size))


def give_zeros(size):
    return bytes(size)


def fail(error):
    raise error


def fail_unpicklably(_):
    raise TwoArgumentsError("one", "two")


def call_again(number):
    """Use the isolation inside a worker."""
    from rbstab.processes.isolated import Limits, isolated

    return isolated(process_of, None, Limits(0.0, 0)), os.getpid(), number


def hang_on(_path):
    time.sleep(600)


def crash_on(_path):
    os.kill(os.getpid(), signal.SIGSEGV)


def crash_once(path):
    """Crash on the first call for a path; the path then exists."""
    if not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGSEGV)
    return "read"


def fill_memory_on(_path):
    return len(bytearray(2 << 30))


def is_in_worker(_path):
    return os.getpid()


def serve_doubles(connection):
    """Answer each number with its double, as the main function of a worker."""
    while True:
        connection.send(2 * connection.recv())


def serve_errors(connection):
    """Answer each request with an exception that names it."""
    while True:
        connection.send(LookupError(connection.recv()))


def crash_at_once(connection):
    os._exit(3)
