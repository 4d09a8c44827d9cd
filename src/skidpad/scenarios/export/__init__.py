"""Runs and hazards as OpenSCENARIO, OpenDRIVE and ASAM OSI."""
