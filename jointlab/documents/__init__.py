"""Documents of the REST interface, by topic. The service and its Python client share them.

Nothing here needs a database, NumPy or an instrument, so a client starts at once.
"""
