// The scene in 3-D: PyVista's still if there is one, and when it is asked for the viewer in a frame, to which the page
// sends the parts that it makes then. Pixels go both ways.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const CAPTION = "Geometry, camera (blue), some rays (ochre), feelers that arrive (blue) or are blocked (orange), normals, lights (yellow) and hit points coloured by their error.";

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
