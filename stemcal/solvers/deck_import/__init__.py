"""From an LS-DYNA deck of a stem to a spec: `keyword_blocks` and `cards` read, `source` converts units, `importing`
finds the stem and its tools, `spec_text` writes. Only the command imports it.
"""
