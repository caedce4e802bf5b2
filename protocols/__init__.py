"""One file per measurement protocol; scenes/ holds ready-to-run scenes."""
