"""The bundled maps as code: `python -m skidpad.roads.generate` writes them anew, byte for byte."""
