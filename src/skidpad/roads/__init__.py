"""Roads: OpenDRIVE to baked lane arrays and roadside objects; queries and routing."""
