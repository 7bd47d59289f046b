"""The task applied to a surface: where the tool has to be along the curves between cell centres."""
