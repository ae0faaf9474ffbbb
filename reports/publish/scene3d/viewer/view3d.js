// A scene's parts as the description that vtk.js's viewer builds a scene from, their layers, and the points' colours.
(function (viewer) {
  "use strict";
  const { mapped } = window.rayproof;

  const channels = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  // Until a pixel is pointed at these have no length, and are not shown.
  const idle = (name, look, cells, corners) => ({ name: `pixel ${name}`, layer: "pixel", look, points: new Float32Array(3 * corners * cells),
    cells: Uint32Array.from({ length: corners * cells }, (_, i) => i), corners, normals: null, color: null, opacity: 1, edges: false });

  // All parts of a view, and what shows the pixel that is pointed at.
  viewer.parts = function (view, look) {
    const counts = { ray: 1, lit: view.lights.length, blocked: view.lights.length, ours: 1, reference: 1, point: 1 };
    return [...view.parts.map((part) => ({ ...part, look: look.layers[part.layer] })),
      ...Object.entries(counts).filter(([, count]) => count).map(([name, count]) => idle(name, look.pixel[name], count, name === "point" ? 1 : 2))];
  };

  // -> {scene, hashes}: instances of VTK's classes with their properties, calls and dependencies, and their arrays.
  viewer.described = function (parts, view, look, dark) {
    const hashes = {};
    let count = 0;
    const array = (values, vtkClass, numberOfComponents, more) => {
      const hash = `array${count += 1}`;
      hashes[hash] = { content: values.buffer };
      return { hash, vtkClass, dataType: values.constructor.name, numberOfComponents, size: values.length, name: hash, ...more };
    };
    const instance = (type, properties, ...dependencies) => ({ id: `${type}${count += 1}`, type, properties, dependencies,
      calls: dependencies.map(([method, one]) => [method, [`instance:\${${one.id}}`]]) });
    const finished = ({ dependencies, ...rest }, parent = "0x0") => ({ ...rest, parent, mtime: 1,
      dependencies: dependencies.map(([, one]) => finished(one, rest.id)) });

    function data(part) {
      const { corners, cells } = part, size = cells.length / corners;
      // VTK puts before each cell how many points it has.
      const counted = new Uint32Array(size * (corners + 1)).fill(corners);
      for (let i = 0; i < size; i += 1) counted.set(cells.subarray(i * corners, (i + 1) * corners), i * (corners + 1) + 1);
      const fields = [];
      if (part.normals) fields.push(array(part.normals, "vtkDataArray", 3, { name: "Normals", location: "pointData", registration: "setNormals" }));
      if (part.name === "points") fields.push(array(new Uint8Array(part.points.length), "vtkDataArray", 3, { name: "colors", location: "pointData", registration: "setScalars" }));
      const kind = { 1: "verts", 2: "lines" }[corners] || "polys";
      return instance("vtkPolyData", { points: array(part.points, "vtkPoints", 3), [kind]: array(counted, "vtkCellArray", 1), fields });
    }

    function actor(part) {
      const lit = part.layer === "geometry", { ambient, diffuse, edges } = look.shape;
      const color = channels((part.color || part.look.color)[dark ? 1 : 0]);
      // Bytes are colours as they are.
      const mapper = { scalarVisibility: Number(part.name === "points" && view.stages.length > 0), colorMode: 0, scalarMode: 1, interpolateScalarsBeforeMapping: 0 };
      const property = { representation: 2, interpolation: part.normals ? 2 : 0, color, ambientColor: color, diffuseColor: color, specularColor: color,
        ambient: lit ? ambient : 0, diffuse: lit ? diffuse : 1, specular: 0, opacity: part.opacity, lighting: Number(lit),
        lineWidth: part.look.width || 1, pointSize: part.look.width || 1, edgeVisibility: Number(lit && part.edges), edgeColor: channels(edges) };
      return instance("vtkActor", { visibility: Number(part.layer !== "pixel") }, ["setMapper", instance("vtkMapper", mapper, ["setInputData", data(part)])],
        ["setProperty", instance("vtkProperty", property)]);
    }

    const { position, up, angle } = view.camera;
    const camera = instance("vtkCamera", { focalPoint: [0, 0, 0], position, viewUp: up, viewAngle: angle });
    const renderer = instance("vtkRenderer", { background: channels(look.background[dark ? 1 : 0]), layer: 0 }, ["setActiveCamera", camera],
      ...parts.map((part) => ["addViewProp", actor(part)]));
    return { scene: finished(instance("vtkRenderWindow", { numberOfLayers: 2 }, ["addRenderer", renderer])), hashes };
  };

  // -> {actor(name), layers: [name], show(layer, visible)} of the renderer that was made of `parts`
  viewer.layers = function (renderer, parts) {
    const actors = renderer.getActors();
    parts.forEach(({ layer }, index) => {
      // What lies on a surface is drawn over it, whichever way the surface leans.
      actors[index].getMapper().setResolveCoincidentTopologyToPolygonOffset();
      if (layer === "geometry") actors[index].getMapper().setRelativeCoincidentTopologyPolygonOffsetParameters(4, 4);
    });
    return {
      layers: [...new Set(parts.map(({ layer }) => layer))].filter((layer) => layer !== "pixel"),
      actor: (name) => actors[parts.findIndex((part) => part.name === name)] || null,
      show: (layer, visible) => parts.forEach((part, index) => { if (part.layer === layer) actors[index].setVisibility(visible); }),
    };
  };

  // -> {low, high, shares: how bad each point is from 0 to 1}; exact is as good as the best, no number as bad as the worst
  viewer.scaled = function (values, measure) {
    const known = values.filter(Number.isFinite), exact = measure === "error" ? -Infinity : Infinity;
    const low = known.reduce((a, b) => Math.min(a, b), Infinity), high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    const worse = (value) => (measure === "error" ? value - low : high - value) / (high - low || 1);
    return { low, high, known: known.length, shares: Array.from(values, (value) => (value === exact ? 0 : Number.isFinite(value) ? worse(value) : 1)) };
  };

  viewer.colour = function (actor, shares, colors) {
    const data = actor.getMapper().getInputData();
    data.getPointData().getScalars().setData(Uint8Array.from(shares.flatMap((share) => mapped(colors, share))), 3);
    data.getPointData().modified();
    data.modified();
  };

  // A bar of the colours as they are drawn, from good to bad.
  viewer.bar = function (canvas, colors) {
    const context = canvas.getContext("2d");
    const picture = context.createImageData(canvas.width, 1);
    for (let i = 0; i < canvas.width; i += 1) picture.data.set([...mapped(colors, i / (canvas.width - 1)), 255], 4 * i);
    context.putImageData(picture, 0, 0);
  };

  // Numbers for people: an error, given by its log10, in its unit, or digits.
  viewer.told = function (value, measure, unit) {
    if (value === (measure === "digits" ? Infinity : -Infinity)) return "exact";
    if (!Number.isFinite(value)) return "no number";
    return measure === "digits" ? `${value.toFixed(1)} digits` : `${(10 ** value).toExponential(1)}${unit && unit !== "1" ? ` ${unit}` : ""}`;
  };

  // The pixel that is pointed at: which hit point the pointer is at, and a pixel's ray, shadow rays and normals.
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

  // The 3-D view of one case: the page that holds this frame sends the parts, and is told of pixels that are pointed at.
  const e = window.rayproof.element;
  const scene = document.getElementById("scene");
  const panel = document.getElementById("panel");
  const tip = document.getElementById("tip");
  const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
  const MEASURES = [["error", "log\u2081\u2080 of the error"], ["digits", "correct digits"]];

  // On disk every file is an origin of its own, called "null", so the window and the token are what there is to check.
  const token = window.name;
  const say = (kind, content) => window.parent.postMessage({ token, kind, ...content }, "*");
  const finite = (value) => typeof value === "number" && Number.isFinite(value);
  // A list of three finite numbers, or null.
  const vector = (value) => (Array.isArray(value) && value.length === 3 && value.every(finite) ? value : null);

  const layerBoxes = (layers, onchange) => e("fieldset", {}, e("legend", {}, "show"), layers.map((layer) => {
    const box = e("input", { type: "checkbox", checked: true, onchange: () => onchange(layer, box.checked) });
    return e("label", { "data-layer": layer }, box, " ", layer);
  }));

  // What colours the points: asks the page for a stage's errors and calls onchange(shares) when they are there.
  function colouring(view, colors, onchange) {
    const low = e("span"), high = e("span");
    const bar = e("canvas", { width: 180, height: 1, "aria-hidden": "true" });
    const chosen = { stage: view.stages.includes(view.colored) ? view.colored : view.stages[0], measure: "error" };
    let values = null;
    const apply = () => {
      if (values?.stage !== chosen.stage) { say("stage", { stage: chosen.stage }); return; }
      const scale = viewer.scaled(values[chosen.measure], chosen.measure);
      const ends = chosen.measure === "error" ? [scale.low, scale.high] : [scale.high, scale.low];
      const words = ends.map((value) => (scale.known ? viewer.told(value, chosen.measure, values.unit) : "exact"));
      window.rayproof.replace(low, words[0]);
      window.rayproof.replace(high, words[1]);
      onchange(scale.shares);
    };
    const select = (key, title, pairs) => window.rayproof.select(title, pairs, chosen[key], (value) => { chosen[key] = value; apply(); });
    const node = e("div", { class: "colouring" },
      select("stage", "points coloured by", view.stages.map((stage) => [stage, stage])),
      select("measure", "measure", MEASURES),
      e("div", { class: "scale" }, bar, low, high));
    viewer.bar(bar, colors);
    return { node, apply, values: () => values, given: (said) => { values = said; apply(); } };
  }

  function lines(view, values, index) {
    const pixel = view.pixels[index];
    const told = values ? `${values.stage}: ${viewer.told(values.error[index], "error", values.unit)}, ${viewer.told(values.digits[index], "digits")}` : "";
    return [`column ${pixel % view.width}, row ${Math.floor(pixel / view.width)}`, told];
  }

  function begin(renderWindow, parts, view, look) {
    // The viewer begins with an empty renderer of its own; the scene's comes after it.
    const renderer = renderWindow.getRenderers().at(-1);
    const layers = viewer.layers(renderer, parts);
    const camera = renderer.getActiveCamera();
    // A frame that is narrower than the still needs a step back, or it cuts both sides off.
    camera.dolly(Math.min(1, (scene.clientWidth / scene.clientHeight) / (look.still[0] / look.still[1])));
    const first = { position: camera.getPosition(), focalPoint: camera.getFocalPoint(), viewUp: camera.getViewUp() };
    const render = () => { renderer.resetCameraClippingRange(); renderWindow.render(); };
    const points = layers.actor("points");
    let drawn = false;
    const ready = () => { render(); if (!drawn) say("drawn", {}); drawn = true; };
    const colours = points && view.stages.length ? colouring(view, look.colors, (shares) => { viewer.colour(points, shares, look.colors); ready(); }) : null;
    window.rayproof.replace(panel,
      e("details", { open: window.innerWidth > 560 }, e("summary", {}, "layers and colours"), colours?.node,
        layerBoxes(layers.layers, (layer, visible) => { layers.show(layer, visible); render(); }),
        e("button", { onclick: () => { camera.set(first); render(); } }, "reset the view")));
    const show = viewer.hands(layers, view, look);
    if (points) {
      viewer.pointing(scene, viewer.picker(renderer, points, scene), (index, x, y) => {
        tip.hidden = index < 0;
        if (index < 0) return;
        window.rayproof.replace(tip, lines(view, colours?.values(), index).map((line) => e("div", {}, line)));
        Object.assign(tip.style, { left: `${Math.min(x + 14, scene.clientWidth - 200)}px`, top: `${y + 14}px` });
      }, (index) => { if (index >= 0) say("pixel", { pixel: [view.pixels[index] % view.width, Math.floor(view.pixels[index] / view.width)] }); });
    }
    viewer.pixel = (said) => {
      show({ position: vector(said.position), ray: vector(said.ray), ours: vector(said.ours),
        theirs: vector(said.theirs), visible: Array.isArray(said.visible) ? said.visible : [] });
      render();
    };
    viewer.values = colours?.given;
    if (colours) colours.apply();
    else ready();
  }

  function open({ view, look }) {
    try {
      const parts = viewer.parts(view, look);
      window.OfflineLocalView.load(scene, { scene: viewer.described(parts, view, look, dark), ready: (renderWindow) => begin(renderWindow, parts, view, look) });
    } catch (error) {
      say("failed", { why: String(error.message).slice(0, 200) });
    }
  }

  const handlers = { scene: open, pixel: (said) => viewer.pixel?.(said), values: (said) => viewer.values?.(said) };
  window.addEventListener("message", (event) => {
    const said = event.data;
    if (event.source !== window.parent || said === null || typeof said !== "object" || said.token !== token) return;
    if (Object.hasOwn(handlers, said.kind)) handlers[said.kind](said);
  });
  if (document.createElement("canvas").getContext("webgl2")) say("ready", {});
  else say("failed", { why: "This browser offers no WebGL 2." });
})(window.viewer = window.viewer || {});
