"""Error against run time: work-precision diagrams of formulas, precisions, samples per pixel and other renderers.

Source of the form of the diagrams (error over time, log-log): the work-precision sets of SciML's benchmark suite
(Rackauckas et al.).
"""
