"""Tables and figures as data, and the base class that each stage extends to describe its result."""
