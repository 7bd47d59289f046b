"""What all tests share: made-up inputs that do not depend on what ran before, and Ctrl-C."""

import signal

from hypothesis.internal.conjecture import providers

# Hypothesis mixes numbers out of the project's source into its examples, of those modules that
# happen to be loaded; tests that are meant to be the same each time would differ with what ran
# before them in the process. No module counts as the project's own.
providers.is_local_module_file = lambda path: False

# A shell lets its background jobs ignore Ctrl-C, and their children with them. Tests that interrupt
# a command they started wait for it in vain, unless it starts with Python's own handler.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
