"""Pictures: the meshcat page, and flat figures."""
