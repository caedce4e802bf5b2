"""Below the traces: progress, log and notes."""
