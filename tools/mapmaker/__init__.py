"""The bundled maps as code: `make data` writes them anew, byte for byte."""
