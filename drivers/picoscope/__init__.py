"""PicoScopes of the ps3000a family, through the vendor's library."""
