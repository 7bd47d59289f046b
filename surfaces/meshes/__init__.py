"""Triangle meshes as surfaces with a continuous normal, repaired, and faces of STEP files."""
