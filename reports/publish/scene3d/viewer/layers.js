// The parts of a scene, and the layers that a reader switches. Colours that are dark on dark are lightened.
(function (viewer) {
  "use strict";

  const LIGHTER = { camera: "#8fbcf0", rays: "#e3b341", "feelers, lit": "#56b4e9", "feelers, blocked": "#ff9d5c",
    "normals, ours": "#ff7b72", "normals, reference": "#8fbcf0" };
  const HIDDEN = new Set(["pixel"]); // until a pixel is pointed at
  const channels = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);

  // -> {actor(name), layers: [name], show(layer, visible)}
  viewer.parts = function (renderer, listed, dark) {
    const actors = renderer.getActors();
    const named = new Map(listed.map(([name], index) => [name, actors[index]]));
    const layers = [...new Set(listed.map(([, layer]) => layer))].filter((layer) => !HIDDEN.has(layer));
    listed.forEach(([, layer], index) => {
      // What lies on a surface is drawn over it, whichever way the surface leans.
      actors[index].getMapper().setResolveCoincidentTopologyToPolygonOffset();
      if (layer === "geometry") actors[index].getMapper().setRelativeCoincidentTopologyPolygonOffsetParameters(4, 4);
      if (HIDDEN.has(layer)) actors[index].setVisibility(false);
      if (dark && LIGHTER[layer]) actors[index].getProperty().setColor(...channels(LIGHTER[layer]));
    });
    return {
      layers,
      actor: (name) => named.get(name) || null,
      show: (layer, visible) => listed.forEach(([, of], index) => { if (of === layer) actors[index].setVisibility(visible); }),
    };
  };

  viewer.background = (renderer, dark) => renderer.setBackground(...channels(dark ? "#12161b" : "#f3f5f8"));
})(window.viewer);
