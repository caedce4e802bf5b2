"""Far ends of current sources."""
