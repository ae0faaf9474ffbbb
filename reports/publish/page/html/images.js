// Two images of any files in the viewer; others are opened or dropped into the page.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const app = document.getElementById("app");
  const images = new Map(); // name -> Map of layer -> image
  const told = e("p", { role: "status", class: "muted" });
  const value = e("p", { class: "muted mono", role: "status" }, "point at an image");
  let current = null;

  const layersOf = () => [...new Set([...images.values()].flatMap((one) => [...one.keys()]))];
  const add = (image) => {
    const again = [...images.keys()].filter((name) => name === image.name || name.startsWith(`${image.name} (`)).length;
    const name = again ? `${image.name} (${again + 1})` : image.name;
    images.set(name, rayproof.layers(image));
    return name;
  };

  async function opened(files) {
    const names = [];
    for (const file of files) {
      try {
        names.push(add(await rayproof.readImage(file)));
        rayproof.replace(told, `${names.join(", ")}: opened`);
      } catch (error) {
        rayproof.replace(told, error.message);
      }
    }
    // The last two that were opened are what is looked at: one beside what was there.
    const all = [...images.keys()];
    if (names.length) rayproof.amend({ ours: names.at(-1), reference: names.length > 1 ? names.at(-2) : rayproof.address().reference || all[0] });
    build();
  }

  function build() {
    const names = [...images.keys()];
    const data = { channels: {}, checks: [], mask: null, renderers: names };
    const set = (parts) => { rayproof.remember(parts); draw(); };
    const view = rayproof.stageView(data, { ours: names, theirs: names, set, onpoint: pointed, onview: () => {} });
    const tabs = e("div", { class: "layers", role: "group", "aria-label": "layers" });
    const draw = () => {
      const wanted = rayproof.address(), settings = rayproof.settings(), layers = layersOf();
      const layer = layers.includes(wanted.stage) ? wanted.stage : layers.includes("colour") ? "colour" : layers[0];
      const other = images.has(wanted.reference) ? wanted.reference : names[0];
      const mine = images.has(wanted.ours) ? wanted.ours : names[1] || names[0];
      const [a, b] = [mine, other].map((name) => images.get(name)?.get(layer) || null);
      data.channels[layer] = (a || b)?.titles || [];
      current = { layer, mine, other, a, b };
      rayproof.replace(tabs, layers.length > 1 ? layers.map((one) => e("button", { "aria-pressed": String(one === layer), onclick: () => set({ stage: one, channel: "", low: "", high: "" }) }, one)) : null);
      if (layer !== undefined) view.draw({ name: layer, unit: "" }, mine, other, a, b, settings);
      document.title = [other, mine].filter(Boolean).join(" and ");
    };
    const file = e("input", { type: "file", multiple: true, accept: ".exr,.pfm,.png", "aria-label": "open images", onchange: () => opened([...file.files]) });
    const rows = [
      ["s", "side by side", () => set({ mode: "side" })], ["w", "swipe", () => set({ mode: "swipe" })], ["f", "flicker", () => set({ mode: "flicker" })],
      ["o", "onion skin", () => set({ mode: "onion" })], ["d", "error only", () => set({ mode: "error" })], [" ", "stop flickering", () => view.viewer.toggle()],
      ["+", "zoom in", () => view.viewer.zoom(2)], ["-", "zoom out", () => view.viewer.zoom(0.5)], ["0", "fit the image in", () => view.viewer.fit()],
      ["n", "zoom to the numbers", () => view.viewer.legible()],
    ];
    rayproof.keys(rows);
    rayproof.replace(app, e("main", { class: "case" }, e("h1", {}, "Images"),
      e("p", {}, e("label", {}, "Open or drop EXR, PFM or PNG files: ", file)), told, tabs,
      e("section", { class: "panel", "aria-label": "Images" }, view.controls, view.node, value)));
    draw();
    requestAnimationFrame(() => view.viewer.restore(1));
  }

  function pointed(x, y) {
    const { a, b, mine, other } = current;
    const at = (image) => (image && x < image.width && y < image.height
      ? image.titles.map((title, c) => `${title} ${rayproof.short(image.values[(y * image.width + x) * image.channels + c], 9)}`).join("  ") : "nothing there");
    rayproof.replace(value, `${x}, ${y}: ${other}: ${at(b)} · ${mine}: ${at(a)}`);
  }

  window.addEventListener("dragover", (event) => event.preventDefault());
  window.addEventListener("drop", (event) => { event.preventDefault(); opened([...event.dataTransfer.files]); });
  (async () => {
    for (const { name, width, height, channels } of JSON.parse(document.getElementById("images").textContent)) {
      const planes = await Promise.all(Object.entries(channels).map(async ([one, stored]) => [one, await rayproof.floats({ ...stored, width, height }, null)]));
      add({ name, width, height, channels: new Map(planes) });
    }
    build();
    app.dataset.shown = "images";
  })();
})(window.rayproof);
