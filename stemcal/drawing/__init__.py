"""Tables and figures as data, and the base class with which each stage shows its result as text, tables and figures."""
