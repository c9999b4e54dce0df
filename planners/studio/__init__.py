"""The studio: a local web page to draw mazes, plan in them, watch and export; the server behind it."""
