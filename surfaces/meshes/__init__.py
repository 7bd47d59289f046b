"""Triangle meshes as surfaces with a continuous normal."""
