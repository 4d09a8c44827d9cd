"""Maps: which are served, their objects, rays against them, the mesh that pedestrians walk on."""
