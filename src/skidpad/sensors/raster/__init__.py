"""From triangles to pixels and ray samples: views, projection, the rasteriser, the scene as it is now."""
