// The specification's shapes as surfaces of polygons in world space: what reports/publish/scene3d/parts.py makes,
// of the same numbers. Vectors are arrays of three, matrices arrays of rows.
(function (rayproof) {
  "use strict";
  const IDENTITY = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
  const CUBE_SIDES = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

  const vector = {
    dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
    cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
    minus: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
    along: (from, direction, length) => [from[0] + length * direction[0], from[1] + length * direction[1], from[2] + length * direction[2]],
    length: (a) => Math.sqrt(vector.dot(a, a)),
    unit: (a) => { const length = vector.length(a); return [a[0] / length, a[1] / length, a[2] / length]; },
  };
  rayproof.vector = vector;

  // Rows of the inverse of an affine matrix's upper 3 x 3, and its determinant.
  function inverted(matrix) {
    const [a, b, c] = matrix.slice(0, 3).map((row) => row.slice(0, 3));
    const columns = [vector.cross(b, c), vector.cross(c, a), vector.cross(a, b)];
    const determinant = vector.dot(a, columns[0]);
    return { determinant, rows: [0, 1, 2].map((i) => columns.map((column) => column[i] / determinant)) };
  }

  // The q quantile of numbers, linear between two of them.
  function quantile(sorted, q) {
    const place = q * (sorted.length - 1), low = Math.floor(place), high = Math.min(low + 1, sorted.length - 1);
    return sorted[low] + (place - low) * (sorted[high] - sorted[low]);
  }
  // -> per axis of points the 5 % and the 95 % quantile
  rayproof.middleOf = (points, axes) => Array.from({ length: axes }, (_, axis) => {
    const sorted = Float64Array.from(points, (point) => point[axis]).sort();
    return [quantile(sorted, 0.05), quantile(sorted, 0.95)];
  });

  // The unit sphere by `around` meridians and half as many circles of latitude; its points are its normals.
  rayproof.ball = function (around) {
    const rings = around / 2, points = [], cells = [];
    for (let ring = 0; ring <= rings; ring += 1) {
      const theta = (Math.PI * ring) / rings;
      for (let place = 0; place < around; place += 1) {
        const phi = (2 * Math.PI * place) / around;
        points.push([Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)]);
        const here = ring * around + place, beside = ring * around + ((place + 1) % around);
        if (ring < rings) cells.push([here, here + around, beside + around, beside]);
      }
    }
    return { points, cells };
  };

  // Where a plane is drawn, in its own space: below those points that lie on it, else below all.
  function patchOf(matrix, inverse, patch, margin) {
    const offset = matrix.slice(0, 3).map((row) => row[3]);
    const local = patch.map((point) => inverse.map((row) => vector.dot(row, vector.minus(point, offset))));
    let largest = 1;
    for (const point of local) for (const value of point) largest = Math.max(largest, Math.abs(value));
    const on = local.filter((point) => Math.abs(point[2]) < 1e-3 * largest);
    return rayproof.middleOf(on.length ? on : local, 2).map(([low, high], axis) => {
      const scale = vector.length(matrix.slice(0, 3).map((row) => row[axis]));
      return [low - margin / scale, high + margin / scale];
    });
  }

  const rectangle = ([[x0, x1], [y0, y1]]) => ({ points: [[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], cells: [[0, 1, 2, 3]] });
  const soup = (corners) => ({ points: corners, cells: Array.from({ length: corners.length / 3 }, (_, i) => [3 * i, 3 * i + 1, 3 * i + 2]) });

  // -> Promise of a scene whose meshes are lists; cases/scene_json.py packs them as float32 and int32.
  async function unpacked(scene) {
    const rows = async (text, Numbers) => {
      const flat = new Numbers((await rayproof.inflate(text)).buffer);
      return Array.from({ length: flat.length / 3 }, (_, i) => [...flat.subarray(3 * i, 3 * i + 3)]);
    };
    const listed = async (shape) => typeof shape.faces !== "string" ? shape
      : { ...shape, vertices: await rows(shape.vertices, Float32Array), faces: await rows(shape.faces, Int32Array) };
    return { ...scene, shapes: await Promise.all(scene.shapes.map(listed)) };
  }

  // -> {points: [[x, y, z]], cells: [[number of a point, ...]], normals: [[x, y, z]] or null}; of a plane, around the
  // points `patch`, `margin` [m] wider.
  rayproof.surface = function (shape, { around, patch, margin }) {
    const matrix = shape.to_world || IDENTITY;
    const place = (p) => [0, 1, 2].map((i) => vector.dot(matrix[i], p) + matrix[i][3]);
    const placed = ({ points, cells }, normals = null) => ({ points: points.map(place), cells, normals });
    if (shape.type === "sphere") {
      const { points, cells } = rayproof.ball(around);
      const { determinant, rows } = inverted(matrix);
      const center = shape.center || [0, 0, 0], radius = shape.radius ?? 1;
      // By the inverse transpose; a mirrored ball would turn its dark side to whoever looks.
      const normals = points.map((n) => vector.unit([0, 1, 2].map((i) => n[0] * rows[0][i] + n[1] * rows[1][i] + n[2] * rows[2][i])));
      return placed({ points: points.map((n) => vector.along(center, n, radius)), cells: determinant > 0 ? cells : cells.map((cell) => [...cell].reverse()) }, normals);
    }
    if (shape.type === "cube") {
      return placed({ points: Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((axis) => ((i >> axis) & 1) - 0.5)), cells: CUBE_SIDES });
    }
    if (shape.type === "square") return placed(rectangle([[-0.5, 0.5], [-0.5, 0.5]]));
    if (shape.type === "plane") return placed(rectangle(patchOf(matrix, inverted(matrix).rows, patch, margin)));
    if (shape.type === "triangle") return placed(soup(shape.vertices));
    if (shape.type === "mesh") return placed(soup(shape.faces.flat().map((vertex) => shape.vertices[vertex])));
    throw new Error(`there is no shape of type ${shape.type}`);
  };

  // What a scene shows in 3-D: named parts in layers, in units of the scene's size around its middle. It is what
  // reports/publish/scene3d/parts.py makes for stills, of the same numbers; look.json tells both how it looks.
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
    const { camera, shapes, lights = [] } = await unpacked(scene), layers = look.layers;
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
    const shadowRays = { "shadow_rays, lit": [], "shadow_rays, blocked": [] };
    if (visible && visible.channels >= places.length) {
      for (const i of few(numbers(points.length), look.shadow_rays)) {
        for (const light of few(numbers(places.length), look.lights)) {
          const layer = visible.values[pixels[i] * visible.channels + light] > 0 ? "shadow_rays, lit" : "shadow_rays, blocked";
          shadowRays[layer].push([points[i], towards(points[i], places[light], layers[layer].length * size)]);
        }
      }
    }
    for (const [layer, ends] of Object.entries(shadowRays)) lines(layer, ends);
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

  // The scene in 3-D: PyVista's still if there is one, and when it is asked for the viewer in a frame, to which the page
  // sends the parts that it makes then. Pixels go both ways.
  const e = rayproof.element;
  const CAPTION = "Geometry, camera (blue), some rays (ochre), shadow rays that arrive (blue) or are blocked (orange), normals, lights (yellow) and hit points coloured by their error.";

  const VIEWER = "viewer/index.html";

  const token = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (word) => word.toString(36)).join("");

  // A frame with the viewer: a page of its own beside the report, or text in a report that is a single file.
  function frame(name) {
    const inlined = rayproof.inlined(VIEWER);
    const node = e("iframe", { src: inlined ? null : rayproof.place(VIEWER), name, title: "The scene in 3-D", class: "frame3d" });
    if (inlined) rayproof.unfolded(VIEWER).then((text) => { node.srcdoc = text; });
    return node;
  }

  const pair = (value, data) => Array.isArray(value) && value.length === 2 && value.every(Number.isInteger)
    && value[0] >= 0 && value[1] >= 0 && value[0] < data.width && value[1] < data.height;

  // What the viewer draws of a pixel: numbers of ours, and the reference's normal.
  async function story(data, ours, theirs, x, y) {
    const at = async (renderer, stage) => {
      const image = renderer ? await data.image(renderer, stage) : null;
      if (!image || x >= image.width || y >= image.height) return null;
      return Array.from(image.values.subarray((y * image.width + x) * image.channels, (y * image.width + x + 1) * image.channels));
    };
    const [object, position, ray, visible, mine, other] = await Promise.all([at(ours, "object"), at(ours, "position"),
      at(ours, "ray"), at(ours, "visibility"), at(ours, "normal"), at(theirs, "normal")]);
    return { position: object && object[0] >= 0 ? position : null, ray, visible: visible || [], ours: mine, theirs: other };
  }

  // -> {node, pixel(x, y, ours, theirs), close()}, or null without picture and view. onpixel(x, y): chosen in 3-D.
  rayproof.scene = function (data, { stages, look, onpixel }) {
    if (!data.picture && !data.view) return null;
    const { ours: mine, theirs: other } = data.view || {};
    const shared = stages.filter(({ name }) => name !== "object" && data.has(mine, name) && data.has(other, name));
    const stage = e("div", { class: "stage3d" });
    const note = e("span", { role: "status" });
    let opened = null, wanted = null, drawn = false, shown = null;

    const post = (kind, content) => opened.node.contentWindow.postMessage({ token: opened.token, kind, ...content }, "*");

    async function pixel(x, y, ours, theirs) {
      wanted = [x, y, ours, theirs];
      if (!drawn) return;
      const told = await story(data, ours, theirs, x, y);
      if (drawn && wanted[0] === x && wanted[1] === y) post("pixel", told);
    }

    const handlers = {
      ready: async () => {
        try {
          shown = await rayproof.sceneParts(data.view, shared.map(({ name }) => name), data.image, look);
          if (opened) post("scene", { view: shown, look });
        } catch (error) {
          handlers.failed({ why: error.message });
        }
      },
      stage: async ({ stage: name }) => {
        const unit = shared.find((item) => item.name === name)?.unit;
        if (unit === undefined) return;
        const [a, b] = await Promise.all([data.image(mine, name), data.image(other, name)]);
        if (opened) post("values", { stage: name, unit, ...rayproof.pointErrors(a, b, shown.pixels) });
      },
      drawn: () => {
        drawn = true;
        opened.node.dataset.drawn = String(Math.round(performance.now() - opened.since));
        if (wanted) pixel(...wanted);
      },
      failed: (said) => { close(); rayproof.replace(note, `No 3-D view: ${said.why}`); },
      pixel: (said) => { if (pair(said.pixel, data)) onpixel(...said.pixel); },
    };

    // On disk every file is an origin called "null": what tells the viewer from a stranger is its window and our token.
    function hear(event) {
      if (!opened?.node.isConnected) { window.removeEventListener("message", hear); return; }
      const said = event.data;
      if (event.source !== opened.node.contentWindow || said === null || typeof said !== "object" || said.token !== opened.token) return;
      if (Object.hasOwn(handlers, said.kind)) handlers[said.kind](said);
    }

    function open() {
      const name = token();
      rayproof.replace(note);
      opened = { token: name, node: frame(name), since: performance.now() };
      window.addEventListener("message", hear);
      figure.classList.add("opened");
      rayproof.replace(stage, opened.node, e("button", { class: "quiet", onclick: close }, "close 3-D"));
    }

    function close() {
      window.removeEventListener("message", hear);
      [opened, drawn, shown] = [null, false, null];
      figure.classList.remove("opened");
      rayproof.replace(stage, poster());
    }

    const poster = () => [
      data.picture ? e("img", { src: rayproof.source(data.picture), width: 600, height: 450, loading: "lazy",
        alt: "The scene with its camera, rays, hit points coloured by error, normals and lights" })
        : e("p", { class: "muted" }, "No still was drawn of this scene."),
      data.view ? e("button", { class: "open3d", onclick: open }, "open in 3-D") : null];

    rayproof.replace(stage, poster());
    const figure = e("figure", { class: "panel scene" }, stage, e("figcaption", { class: "muted" }, CAPTION, " ", note));
    return { pixel, close, node: figure };
  };
})(window.rayproof);
