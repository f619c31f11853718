"""The study: its spec read and checked (spec, rules), units, the frozen data classes."""
