"""From raster buffers to colour images: light, sky, shading, what weather and the lens do to them."""
