"""The hammer session: blows at each point, and their checks."""
