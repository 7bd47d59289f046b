"""Industrial arms: their URDFs, written by `tools/industrial_urdfs.py` from `arms.toml`."""
