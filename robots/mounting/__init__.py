"""Where an arm is mounted: poses as they are given, its base, TCP, the tool's axes."""
