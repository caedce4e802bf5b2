"""The serial line: bytes out, answers back, and what was said."""
