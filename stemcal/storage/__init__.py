"""Files: atomic writing, reproducible and sealed JSON, size-limited reading, and detection of text encodings."""
