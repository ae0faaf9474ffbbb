"""What the tracer asks of Dr.Jit and its devices: types, arithmetic, parameters, branches and the compiler."""
