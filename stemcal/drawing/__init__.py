"""Tables and figures as data, and the base class of what shows a stage."""
