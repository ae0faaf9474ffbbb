// What a scene shows in 3-D: named parts in layers, in units of the scene's size around its middle. It is what
// reports/publish/scene3d/parts.py makes for stills, of the same numbers; look.json tells both how it looks.
(function (rayproof) {
  "use strict";
  const v = rayproof.vector;
  // What is coloured unless the case blames a stage of its own.
  const COLORED = ["distance", "position", "radiance"];
  const numbers = (count) => Array.from({ length: count }, (_, i) => i);
  const finite = (values) => values.every(Number.isFinite);

  // -> at most `most` of the entries, evenly spaced
  function few(list, most) {
    const count = Math.min(list.length, most), step = (list.length - 1) / (count - 1);
    return numbers(count).map((i) => list[count === 1 ? 0 : i === count - 1 ? list.length - 1 : Math.floor(i * step)]);
  }

  const at = (image, pixel) => Array.from(image.values.subarray(pixel * image.channels, (pixel + 1) * image.channels));
  const alike = (a, b) => a && b && a.width === b.width && a.height === b.height && a.channels === b.channels;

  // The largest absolute difference over a pixel's channels; NaN and infinities stay what they are.
  function difference(a, b, pixel) {
    let worst = 0;
    for (let i = pixel * a.channels; i < (pixel + 1) * a.channels; i += 1) {
      const error = a.values[i] === b.values[i] ? 0 : Math.abs(a.values[i] - b.values[i]);
      if (!(error <= worst)) worst = error;
      if (Number.isNaN(worst)) return NaN;
    }
    return worst;
  }

  // -> log10 of the error and correct digits of some pixels: infinite where exact, NaN where they are no number
  rayproof.pointErrors = function (a, b, pixels) {
    const error = new Float64Array(pixels.length), digits = new Float64Array(pixels.length);
    pixels.forEach((pixel, i) => {
      const off = difference(a, b, pixel), size = Math.max(...at(b, pixel).map(Math.abs));
      const known = off === 0 || Number.isFinite(off);
      error[i] = known ? Math.log10(off) : NaN;
      digits[i] = !known ? NaN : off === 0 ? Infinity : -Math.log10(off / size);
    });
    return { error, digits };
  };

  // Pixels of some hits, evenly spaced and the worst by `errorOf` among them.
  function chosenPixels(object, position, errorOf, look) {
    const hits = [];
    for (let pixel = 0; pixel < object.width * object.height; pixel += 1) {
      const p = 3 * pixel, values = position.values;
      if (object.values[pixel * object.channels] >= 0 && Number.isFinite(values[p]) && Number.isFinite(values[p + 1]) && Number.isFinite(values[p + 2])) hits.push(pixel);
    }
    const worst = []; // [how bad, pixel], the least bad first, of equally bad ones the later pixels
    if (errorOf) {
      for (const pixel of hits) {
        const off = errorOf(pixel), bad = Number.isFinite(off) ? off : Infinity;
        if (worst.length === look.worst && bad < worst[0][0]) continue;
        let place = worst.length;
        while (place > 0 && worst[place - 1][0] > bad) place -= 1;
        worst.splice(place, 0, [bad, pixel]);
        if (worst.length > look.worst) worst.shift();
      }
    }
    return [...new Set([...few(hits, look.points), ...worst.map(([, pixel]) => pixel)])].sort((a, b) => a - b);
  }

  // Forward, right and up of a camera, each of length 1.
  function basis(camera) {
    const forward = v.unit(v.minus(camera.target, camera.eye)), right = v.unit(v.cross(forward, camera.up));
    return [forward, right, v.cross(right, forward)];
  }

  const bounds = (points) => {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const point of points) for (let i = 0; i < 3; i += 1) { low[i] = Math.min(low[i], point[i]); high[i] = Math.max(high[i], point[i]); }
    return [low, high];
  };

  // What is framed: the hits, the bounded shapes and, unless they are far, eye and lights.
  function framing(camera, points, bounded, others) {
    // Hits out to the horizon would shrink everything else to nothing: the middle nine tenths decide.
    const middle = points.length ? rayproof.middleOf(points, 3) : [];
    const corners = [...(points.length ? [middle.map(([low]) => low), middle.map(([, high]) => high)] : []), ...bounded.flatMap((surface) => bounds(surface.points))];
    const inside = corners.length ? corners : [camera.target];
    const [low, high] = bounds(inside);
    const size = v.length(v.minus(high, low)) || v.length(v.minus(others[0], inside[0])) || 1;
    const center = low.map((value, i) => (value + high[i]) / 2);
    const [least, most] = bounds([...inside, ...others.filter((point) => v.length(v.minus(point, center)) < 2.5 * size)]);
    return { middle: least.map((value, i) => (value + most[i]) / 2), size: v.length(v.minus(most, least)) || 1 };
  }

  function frustum(camera, size, depth) {
    const [forward, right, up] = basis(camera), half = depth * size * Math.tan((camera.fovy * Math.PI) / 360);
    const middle = v.along(camera.eye, forward, depth * size);
    const ends = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => v.along(v.along(middle, right, (x * half * camera.width) / camera.height), up, y * half));
    const tick = ends[2].map((value, i) => (value + ends[3][i]) / 2);
    return [...ends.map((end) => [camera.eye, end]), ...ends.map((end, i) => [end, ends[(i + 1) % 4]]), [tick, v.along(tick, up, 0.25 * half)]];
  }

  // The point from one towards another, at most so far [m].
  function towards(from, to, most) {
    const way = v.minus(to, from);
    return v.along(from, way, Math.min(1, most / Math.max(v.length(way), 1e-300)));
  }

  const hex = (albedo, { albedo: scale, white }) => `#${albedo.map((value) => Math.floor(255 * Math.min(1, Math.max(0, value * scale + white)) + 0.5).toString(16).padStart(2, "0")).join("")}`;

  // -> Promise of {parts: [{name, layer, points, cells, corners, normals, color, opacity, edges}], camera, middle, size,
  // eye, lights, pixels, colored, stages}; points and normals are Float32Arrays, cells a Uint32Array of the numbers of
  // each cell's points. `image(renderer, stage)` promises an image or null; `view` is what the case's record has.
  rayproof.sceneParts = async function ({ scene, ours, theirs, stage: blamed }, stages, image, look) {
    const { camera, shapes, lights = [] } = scene, layers = look.layers;
    const pairs = await Promise.all([blamed, ...COLORED].filter((stage) => stages.includes(stage)).slice(0, 4)
      .map(async (stage) => [stage, ours && theirs ? await image(ours, stage) : null, ours && theirs ? await image(theirs, stage) : null]));
    const [colored, a, b] = pairs.find(([, mine, other]) => alike(mine, other)) || [null];
    const answering = ours || theirs;
    const [object, position, normal, visible, other] = await Promise.all([...["object", "position", "normal", "visibility"]
      .map((stage) => (answering ? image(answering, stage) : null)), ours && theirs ? image(theirs, "normal") : null]);
    const pixels = object && position ? chosenPixels(object, position, colored && ((pixel) => difference(a, b, pixel)), look) : [];
    const points = pixels.map((pixel) => at(position, pixel));
    const [least, most] = look.around, balls = shapes.filter((shape) => shape.type === "sphere").length;
    const around = 2 * Math.floor(Math.floor(Math.min(most, Math.max(least, Math.sqrt((2 * look.quads) / Math.max(1, balls))))) / 2);
    const surfaces = shapes.map((shape) => (shape.type === "plane" ? null : rayproof.surface(shape, { around })));
    const places = lights.map((light) => light.position);
    const { middle, size } = framing(camera, points, surfaces.filter(Boolean), [camera.eye, ...places]);
    const inside = (point) => point.map((value, i) => (value - middle[i]) / size);
    const near = (point) => v.length(inside(point)) < look.far;
    const parts = [];
    const add = (name, layer, corners, cells, more = {}) => {
      if (!cells.length) return;
      parts.push({ name, layer, normals: null, color: null, opacity: 1, edges: false, ...more, corners: cells[0].length,
        points: Float32Array.from(corners.flat()), cells: Uint32Array.from(cells.flat()) });
    };
    const lines = (layer, ends) => add(layer, layer, ends.flat().map(inside), numbers(ends.length).map((i) => [2 * i, 2 * i + 1]));

    const eye = inside(camera.eye);
    shapes.forEach((shape, index) => {
      const drawn = surfaces[index] || rayproof.surface(shape, { patch: points.length ? points : [camera.target], margin: look.margin * size });
      const corners = drawn.points.map(inside), [low, high] = bounds(corners);
      // One that the camera is inside of would hide everything.
      const surrounds = eye.every((value, i) => low[i] < value && value < high[i]);
      const color = hex(shape.albedo, look.shape);
      add(`shape ${index}`, "geometry", corners, drawn.cells, { normals: drawn.normals && Float32Array.from(drawn.normals.flat()),
        color: [color, color], opacity: surrounds ? look.shape.surrounding : 1, edges: drawn.cells.length < look.shape.few });
    });
    if (near(camera.eye)) lines("camera", frustum(camera, size, look.frustum));
    const bulbs = few(places, look.lights).filter(near).map(inside), bulb = rayproof.ball(12);
    add("lights", "lights", bulbs.flatMap((place) => bulb.points.map((point) => v.along(place, point, layers.lights.length))),
      bulbs.flatMap((_, i) => bulb.cells.map((cell) => cell.map((corner) => corner + i * bulb.points.length))));
    // From afar only the last stretch: lines a kilometre long lose their digits in the depth buffer.
    lines("rays", few(points, look.rays).map((point) => [towards(point, camera.eye, layers.rays.length * size), point]));
    const feelers = { "feelers, lit": [], "feelers, blocked": [] };
    if (visible && visible.channels >= places.length) {
      for (const i of few(numbers(points.length), look.feelers)) {
        for (const light of few(numbers(places.length), look.lights)) {
          const layer = visible.values[pixels[i] * visible.channels + light] > 0 ? "feelers, lit" : "feelers, blocked";
          feelers[layer].push([points[i], towards(points[i], places[light], layers[layer].length * size)]);
        }
      }
    }
    for (const [layer, ends] of Object.entries(feelers)) lines(layer, ends);
    add("points", "points", points.map(inside), numbers(points.length).map((i) => [i]));
    for (const [layer, normals] of [["normals, ours", normal], ["normals, reference", other]]) {
      if (!normals) continue;
      const ends = few(numbers(points.length), look.normals).map((i) => [points[i], at(normals, pixels[i])]).filter(([, n]) => finite(n) && v.length(n) > 0.5);
      lines(layer, ends.map(([point, n]) => [point, v.along(point, n, layers[layer].length * size)]));
    }
    const axes = basis(camera), { from, distance, angle } = look.camera;
    const direction = v.unit([0, 1, 2].map((i) => from[0] * axes[0][i] + from[1] * axes[1][i] + from[2] * axes[2][i]));
    return { parts, camera: { position: direction.map((value) => value * distance), up: axes[2], angle },
      middle, size, eye: camera.eye, lights: places, pixels, colored, width: object?.width || 0,
      stages: ours && theirs ? stages : [] };
  };
})(window.rayproof);
