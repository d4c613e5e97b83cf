"""Checks of a measuring chain, from sensor to converter, on records whose content is known."""
