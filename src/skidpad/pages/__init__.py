"""How Skidpad serves pages: who may look, one guard before everything, a server that knows its port."""
