"""Charts of the page as data: options of charts and SVG, made from plain arrays."""
