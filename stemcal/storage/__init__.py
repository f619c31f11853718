"""Text and bytes on disk: files there whole or not at all, JSON of the same bytes, decoding of what others wrote."""
