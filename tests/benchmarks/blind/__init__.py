"""Blind suite of the diagnosis: plants with something hidden, integrated by code of its own."""
