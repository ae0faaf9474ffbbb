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
})(window.viewer = window.viewer || {});
