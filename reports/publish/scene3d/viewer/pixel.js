// The pixel that is pointed at: which hit point the pointer is at, and a pixel's ray, feelers and normals.
(function (viewer) {
  "use strict";

  const REACH = 9; // CSS px
  const along = (from, direction, length) => from.map((value, axis) => value + length * direction[axis]);

  // -> (x, y) => number of the point that is nearest to a place of the node [CSS px], or -1
  viewer.picker = function (renderer, actor, node) {
    const points = actor.getMapper().getInputData().getPoints().getData();
    return function (x, y) {
      const { clientWidth: width, clientHeight: height } = node;
      const matrix = renderer.getActiveCamera().getCompositeProjectionMatrix(width / height, -1, 1);
      let best = -1, nearest = REACH * REACH, front = Infinity;
      for (let i = 0; i < points.length; i += 3) {
        const row = (r) => matrix[4 * r] * points[i] + matrix[4 * r + 1] * points[i + 1] + matrix[4 * r + 2] * points[i + 2] + matrix[4 * r + 3];
        const w = row(3);
        if (w <= 0) continue;
        const dx = (0.5 + row(0) / w / 2) * width - x;
        const dy = (0.5 - row(1) / w / 2) * height - y;
        const away = dx * dx + dy * dy;
        // Of points that lie on one another the one in front.
        if (away < nearest - 1 || (away < nearest + 1 && away < REACH * REACH && w < front)) [best, nearest, front] = [i / 3, away, w];
      }
      return best;
    };
  };

  // Calls `moved(index, x, y)` while the pointer moves and `chosen(index)` on a click that was no drag.
  viewer.pointing = function (node, pick, moved, chosen) {
    let down = null;
    const place = (event) => {
      const box = node.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    node.addEventListener("pointermove", (event) => { if (!event.buttons) moved(pick(...place(event)), ...place(event)); });
    node.addEventListener("pointerleave", () => moved(-1, 0, 0));
    node.addEventListener("pointerdown", (event) => { down = place(event); }, true);
    node.addEventListener("pointerup", (event) => {
      const [x, y] = place(event);
      if (down && Math.hypot(x - down[0], y - down[1]) < 4) chosen(pick(x, y));
      down = null;
    }, true);
  };

  // -> (pixel) => nothing; pixel: {position: [x, y, z] or null, ray, ours, theirs, visible}, world units.
  viewer.hands = function (layers, view, look) {
    const inside = (point) => point.map((value, axis) => (value - view.middle[axis]) / view.size);

    function place(name, ends) {
      const actor = layers.actor(`pixel ${name}`);
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
      const eye = inside(view.eye);
      const hit = pixel.position && inside(pixel.position);
      const far = hit || (pixel.ray && along(eye, pixel.ray, look.pixel.ray.length));
      place("ray", far ? [eye, far] : []);
      place("point", hit ? [hit] : []);
      for (const [name, wanted] of [["lit", true], ["blocked", false]]) {
        const lights = hit ? view.lights.filter((_, index) => pixel.visible[index] > 0 === wanted) : [];
        place(name, lights.flatMap((light) => [hit, inside(light)]));
      }
      place("ours", hit && pixel.ours ? [hit, along(hit, pixel.ours, look.pixel.ours.length)] : []);
      place("reference", hit && pixel.theirs ? [hit, along(hit, pixel.theirs, look.pixel.reference.length)] : []);
    };
  };
})(window.viewer);
