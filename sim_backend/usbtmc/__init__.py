"""Far ends on a simulated USB bus."""
