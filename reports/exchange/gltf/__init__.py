"""glTF 2.0 (Khronos 2021) with KHR_lights_punctual: triangles, perspective cameras, point lights, base colours.

Sections in docstrings are the glTF 2.0 specification's.
"""
