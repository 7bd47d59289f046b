"""`ask`, for tests that have not moved yet."""

from ask import ask  # noqa: F401
