"""Driving channels: driven, evaluated, monitored, and what a monitor found."""
