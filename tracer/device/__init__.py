"""What the tracer asks of Dr.Jit and its devices: types, buffers, kernels, tiles and the LLVM that compiles them."""
