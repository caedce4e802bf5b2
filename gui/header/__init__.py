"""The dark bar on top: identity, instruments, clock, STOP."""
