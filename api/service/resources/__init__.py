"""The resources of the service, a file each: its documents, and its routes."""
