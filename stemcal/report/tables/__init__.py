"""Tables as data, and how the terminal draws them."""
