"""What is on screen: the plan, a run in progress, runs from disk."""
