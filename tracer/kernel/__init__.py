"""The use of Dr.Jit and its devices: types, arithmetic, parameters and the compiler."""
