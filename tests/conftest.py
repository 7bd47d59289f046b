"""What all tests share: made-up inputs that do not depend on what ran before."""

from hypothesis.internal.conjecture import providers

# Hypothesis mixes numbers out of the project's source into its examples, of those modules that
# happen to be loaded; tests that are meant to be the same each time would differ with what ran
# before them in the process. No module counts as the project's own.
providers.is_local_module_file = lambda path: False
