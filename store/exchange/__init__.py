"""Files that are read and written in a fixed format: measurement bundles and the Universal File Format."""
