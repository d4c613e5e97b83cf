"""Routes of the service, a file for each topic. Each file exports one router or several."""
