"""Writes where a program's threads are when the grader requests it by a signal.

A separate thread answers. It holds the interpreter's lock while it writes, so that no other thread runs meanwhile. If a
signal handler, which takes no lock, wrote the stacks, a thread that returns or ends at that moment could free data that
the handler reads, and the program would be ended by signal 11 only because it was observed.
"""

import _thread
import faulthandler
import os
import signal

STACK_SIGNAL = signal.SIGRTMIN + 10
"""The signal by which `sandbox/running_program.py` requests the stacks."""

END = b"\n=\n"
"""The end of an answer."""


def answer(descriptor: int) -> None:
    """Begin to answer on this descriptor, in a thread that Python's `threading` does not know."""
    signal.pthread_sigmask(signal.SIG_BLOCK, [STACK_SIGNAL])  # all threads of the program inherit this
    _thread.start_new_thread(_answer, (descriptor,))


def _answer(descriptor: int) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())  # other signals go to the program's own threads
    while True:
        signal.sigwait([STACK_SIGNAL])
        faulthandler.dump_traceback(descriptor, all_threads=True)
        os.write(descriptor, END)
