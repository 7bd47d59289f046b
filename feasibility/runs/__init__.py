"""Passes in as few motions as the known ones allow, where no single one runs them all."""
