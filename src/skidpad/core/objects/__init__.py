"""How objects are made, registered, copied and written as state."""
