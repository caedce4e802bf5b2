"""One run in progress: the deciding loop, its threads, spikes on line."""
