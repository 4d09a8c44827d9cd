"""Options that commands share: fields of values as options, campaigns, folders, the CARLA server."""
