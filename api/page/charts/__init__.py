"""What the page draws, as data: options of charts and SVG, made from plain arrays."""
