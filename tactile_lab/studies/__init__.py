"""Studies: one scene at many points, on every core, in one data set."""
