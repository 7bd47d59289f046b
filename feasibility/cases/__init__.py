"""A question as TOML, read with every fault named."""
