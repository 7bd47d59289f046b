"""The command `coverable`."""
