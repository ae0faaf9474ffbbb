"""How fast rayproof is: the tracer beside other renderers (`bench`), a run as the suite grows (`growth`)."""
