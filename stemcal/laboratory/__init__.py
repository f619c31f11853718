"""Virtual laboratory tests of a piece of stem besides cutting; `perform` simulates them, each kind has a module."""
