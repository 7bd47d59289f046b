"""Pictures of areas: treated once, more often or not at all."""
