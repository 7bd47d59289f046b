"""The picture of a STEP file: its faces with their numbers."""
