"""Makes `stackfakes` importable for the tests below this folder."""
