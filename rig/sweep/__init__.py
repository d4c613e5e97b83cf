"""The swept sine of the direct method, driven by us or by the machine's own software."""
