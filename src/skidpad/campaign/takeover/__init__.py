"""A person beside the driver: takes over, switches functions, changes weather and traffic."""
