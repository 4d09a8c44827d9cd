"""Our own OpenDRIVE importer (decision M-15): records, geometry, lanes, links, signals, objects."""
