"""Where a program's threads are, written when the grader asks for it by a signal.

A thread of its own answers. It holds the interpreter's lock while it writes, so that no thread runs meanwhile. Were the
stacks written by the signal's handler, which takes no lock, then a thread that returns or ends at that moment would
free what the handler reads, and the program would be ended by signal 11 for being looked at.
"""

import _thread
import faulthandler
import os
import signal

STACK_SIGNAL = signal.SIGRTMIN + 10
"""What `sandbox/running_program.py` asks with."""

END = b"\n=\n"
"""What follows an answer."""


def answer(descriptor: int) -> None:
    """Begin to answer on this descriptor, in a thread that Python's `threading` does not know of."""
    signal.pthread_sigmask(signal.SIG_BLOCK, [STACK_SIGNAL])  # in the threads of the program, too
    _thread.start_new_thread(_answer, (descriptor,))


def _answer(descriptor: int) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())  # the program's own go to its own threads
    while True:
        signal.sigwait([STACK_SIGNAL])
        faulthandler.dump_traceback(descriptor, all_threads=True)
        os.write(descriptor, END)
