"""How kernels are compiled and kept, and kernels that several packages call."""
