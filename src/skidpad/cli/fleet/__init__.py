"""The fleet's service, the vehicle's side of it, and a demo of both."""
