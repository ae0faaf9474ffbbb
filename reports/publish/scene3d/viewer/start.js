// The 3-D view of one case: the page that holds this frame sends it, and is told of pixels that are pointed at.
(function (viewer) {
  "use strict";
  const e = window.rayproof.element;
  const scene = document.getElementById("scene");
  const panel = document.getElementById("panel");
  const tip = document.getElementById("tip");
  const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;

  function lines(about, chosen, index) {
    const [column, row] = about.points.pixels[index];
    const stage = about.points.stages[chosen?.stage];
    const told = stage ? `${chosen.stage}: ${viewer.told(stage.error[index], "error", stage.unit)}, ${viewer.told(stage.digits[index], "digits")}` : "";
    return [`column ${column}, row ${row}`, told];
  }

  function begin(renderWindow, about) {
    // The viewer begins with an empty renderer of its own; the scene's comes after it.
    const renderer = renderWindow.getRenderers().at(-1);
    const parts = viewer.parts(renderer, about.parts, dark);
    const camera = renderer.getActiveCamera();
    // A frame higher than wide needs a step back, or it cuts both sides off.
    camera.dolly(Math.min(1, scene.clientWidth / scene.clientHeight));
    const first = { position: camera.getPosition(), focalPoint: camera.getFocalPoint(), viewUp: camera.getViewUp() };
    const render = () => { renderer.resetCameraClippingRange(); renderWindow.render(); };
    const points = parts.actor("points");
    viewer.background(renderer, dark);
    const colouring = points && viewer.colouring(about, points.getMapper().getLookupTable(), (stage, measure) => {
      const scale = viewer.scaled(about.points.stages[stage][measure], measure);
      viewer.colour(points, scale.shares);
      render();
      return scale;
    });
    window.rayproof.replace(panel,
      e("details", { open: window.innerWidth > 560 }, e("summary", {}, "layers and colours"), colouring && colouring.node,
        viewer.layerBoxes(parts.layers, (layer, visible) => { parts.show(layer, visible); render(); }),
        e("button", { onclick: () => { camera.set(first); render(); } }, "reset the view")));
    const show = viewer.hands(parts, about);
    if (points) {
      viewer.pointing(scene, viewer.picker(renderer, points, scene), (index, x, y) => {
        tip.hidden = index < 0;
        if (index < 0) return;
        window.rayproof.replace(tip, lines(about, colouring?.chosen, index).map((line) => e("div", {}, line)));
        Object.assign(tip.style, { left: `${Math.min(x + 14, scene.clientWidth - 200)}px`, top: `${y + 14}px` });
      }, (index) => { if (index >= 0) viewer.say("pixel", { pixel: about.points.pixels[index] }); });
    }
    viewer.pixel = (said) => {
      show({ position: viewer.vector(said.position), ray: viewer.vector(said.ray), ours: viewer.vector(said.ours),
        theirs: viewer.vector(said.theirs), visible: Array.isArray(said.visible) ? said.visible : [] });
      render();
    };
    render();
    viewer.say("drawn", {});
  }

  async function open(said) {
    try {
      const { about, scene: described, hashes } = await viewer.unpack(String(said.text));
      window.OfflineLocalView.load(scene, { scene: { scene: described, hashes }, ready: (renderWindow) => begin(renderWindow, about) });
    } catch (error) {
      viewer.say("failed", { why: String(error.message).slice(0, 200) });
    }
  }

  viewer.listen({ scene: open, pixel: (said) => viewer.pixel?.(said) });
  if (document.createElement("canvas").getContext("webgl2")) viewer.say("ready", {});
  else viewer.say("failed", { why: "This browser offers no WebGL 2." });
})(window.viewer);
