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
    from feasibility.cli import run

    run()
