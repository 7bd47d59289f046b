"""Pictures of passes over a surface, numbered, with what they treat."""
