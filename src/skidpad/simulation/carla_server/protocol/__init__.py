"""The protocol's bytes: msgpack-rpc, tables of methods, streams, the shapes of values."""
