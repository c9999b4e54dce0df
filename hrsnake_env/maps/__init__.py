"""Maps in: a maze from a ROS map, an occupancy image, SVG, DXF or GeoJSON outlines."""

from hrsnake_env.maps.reading import MapFiles, MapOptions, MapReading

__all__ = ["MapFiles", "MapOptions", "MapReading"]
