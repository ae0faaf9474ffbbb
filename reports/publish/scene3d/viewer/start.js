// The 3-D view of one case: the page that holds this frame sends the parts, and is told of pixels that are pointed at.
(function (viewer) {
  "use strict";
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
})(window.viewer);
