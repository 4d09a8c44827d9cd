"""The fleet's pages by NiceGUI: dashboard, teleoperator, replay, places, safety case (R-10)."""
