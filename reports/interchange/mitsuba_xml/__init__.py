"""Mitsuba 3 XML (https://mitsuba.readthedocs.io, "Scene XML file format"): parsed by Mitsuba's own parser.

Perspective sensors; spheres, cubes, rectangles, OBJ and PLY meshes, instances of groups of them; diffuse and two-sided
materials; point lights. A disk whose id begins with "infinite-plane" stands for a plane. Whatever else a file holds is
left out or replaced, and told.
"""

PLANE = "infinite-plane"  # how the id of a disk begins that stands for a plane
