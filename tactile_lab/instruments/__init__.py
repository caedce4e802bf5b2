"""What instruments can, said before any is opened: dialects as data, the registry."""
