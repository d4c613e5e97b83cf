"""The further experiment that tells most, and the data that answer it."""
