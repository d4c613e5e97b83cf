"""Files that others write or read: measurement bundles and the Universal File Format."""
