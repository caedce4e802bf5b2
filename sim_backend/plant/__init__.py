"""The simulated physical world: coil, magnet, sensor, followers, codes."""
