"""The command `coverable` as a process: from its first line on, Ctrl-C is status 130.

What it works with is imported only when Ctrl-C is heard: an import that is interrupted would end in
a traceback.
"""

import os


def _leave(*_: object) -> None:
    """End at once: nothing has been begun."""
    os.write(2, b"coverable: interrupted\n")
    os._exit(130)


try:
    import signal

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
except KeyboardInterrupt:
    _leave()


def run() -> None:
    """Run the command line, and end the process with its status."""
    import gc

    # Most of what is made at first stays to the end: looking through it again and again for what
    # is not needed any more takes a fifth of a short command.
    gc.set_threshold(100_000, 20, 20)
    from feasibility.cli.main import run

    run()
