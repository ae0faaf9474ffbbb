// One pixel's ray, feelers and normals, drawn with the lines that the scene keeps ready for it.
(function (viewer) {
  "use strict";

  const LONG = 3; // scene sizes that a ray which hits nothing is drawn
  const NORMAL = 0.12; // scene sizes
  const along = (from, direction, length) => from.map((value, axis) => value + length * direction[axis]);

  // -> (pixel) => nothing; pixel: {position: [x, y, z] or null, ray, ours, theirs, visible}, world units.
  viewer.hands = function (parts, about) {
    const inside = (point) => point.map((value, axis) => (value - about.middle[axis]) / about.size);

    function place(name, ends) {
      const actor = parts.actor(`pixel ${name}`);
      if (!actor) return;
      const points = actor.getMapper().getInputData().getPoints();
      const data = new Float32Array(points.getData().length);
      // Lines that are not needed have both ends in one place.
      for (let i = 0; i < data.length; i += 3) data.set(ends[Math.min(i / 3, ends.length - 1)] || [0, 0, 0], i);
      points.setData(data, 3);
      points.modified();
      actor.getMapper().getInputData().modified();
      actor.setVisibility(ends.length > 0);
    }

    return function (pixel) {
      const eye = inside(about.eye);
      const hit = pixel.position && inside(pixel.position);
      const far = hit || (pixel.ray && along(eye, pixel.ray, LONG));
      place("ray", far ? [eye, far] : []);
      place("point", hit ? [hit] : []);
      for (const [name, wanted] of [["lit", true], ["blocked", false]]) {
        const lights = hit ? about.lights.filter((_, index) => pixel.visible[index] > 0 === wanted) : [];
        place(name, lights.flatMap((light) => [hit, inside(light)]));
      }
      place("ours", hit && pixel.ours ? [hit, along(hit, pixel.ours, NORMAL)] : []);
      place("reference", hit && pixel.theirs ? [hit, along(hit, pixel.theirs, 1.25 * NORMAL)] : []);
    };
  };
})(window.viewer);
