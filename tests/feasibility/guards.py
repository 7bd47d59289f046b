"""How long tests wait for what comes at once: against hanging alone, so no load is too much."""

GUARD_S = 1800.0
