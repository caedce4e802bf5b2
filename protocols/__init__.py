"""One file per protocol; scenes/ and studies/ that are ready to run."""
