"""glTF 2.0 (Khronos 2021): triangles, their strips and fans, perspective cameras, point lights, base colours.

Of extensions it has KHR_lights_punctual and KHR_mesh_quantization.

Sections in docstrings are the glTF 2.0 specification's.
"""
