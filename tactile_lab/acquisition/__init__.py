"""One run in progress: the deciding loop and its threads."""
