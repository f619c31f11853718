"""Tables to publish."""
