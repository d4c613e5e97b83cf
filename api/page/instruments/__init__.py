"""Parts of the view of instruments."""
