"""Physics: weather to grip and optics; tyres, vehicles and contacts."""
