"""Dr.Jit and its devices: types, lanes, arithmetic, parameters, the compiler."""
