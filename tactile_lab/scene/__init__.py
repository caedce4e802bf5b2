"""Scene and bench files: what one run uses, validated, in SI."""
