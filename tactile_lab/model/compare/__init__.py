"""Our solver beside others: error against run time, and extreme cases."""
