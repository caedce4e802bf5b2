"""One file per protocol, its trials, meaning and plots; scenes/ are ready to run."""
