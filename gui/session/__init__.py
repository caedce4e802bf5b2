"""What runs behind the window: runs, plans, checks, the coil by hand."""
