"""Single runs and stored results: shown, compared, driven again, exported, watched in the cockpit."""
