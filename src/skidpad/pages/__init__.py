"""How Skidpad serves pages: sessions, one guard before everything, a server that knows its port."""
