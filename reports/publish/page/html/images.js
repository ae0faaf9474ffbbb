// The page of any two images: files are dropped or chosen, read and shown.
(function (rayproof) {
  "use strict";

  // Image files that are dropped into the page: OpenEXR (scan lines; not compressed, ZIP or ZIPS), PFM, and what the browser itself
  // reads. -> {name, width, height, channels: Map of name -> Float32Array}; whatever is wrong is an Error in words.

  const ZIPS = 2, ZIP = 3;
  const SIZES = [4, 2, 4]; // bytes of a number: unsigned, half, float

  function half(code) {
    const sign = code & 0x8000 ? -1 : 1, exponent = (code >> 10) & 31, fraction = code & 1023;
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -14 * (fraction / 1024));
  }

  const numberAt = (view, at, type) => (type === 1 ? half(view.getUint16(at, true)) : type === 2 ? view.getFloat32(at, true) : view.getUint32(at, true));

  async function inflated(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const codes = new Uint8Array(await new Response(stream).arrayBuffer());
    for (let i = 1; i < codes.length; i += 1) codes[i] = codes[i - 1] + codes[i] - 128;
    const plain = new Uint8Array(codes.length), middle = (codes.length + 1) >> 1;
    for (let i = 0; i < codes.length; i += 1) plain[i] = codes[i % 2 ? middle + (i >> 1) : i >> 1];
    return plain;
  }

  async function exr(name, buffer) {
    const view = new DataView(buffer), bytes = new Uint8Array(buffer);
    if (view.getUint32(4, true) & 0x1a00) throw new Error(`${name}: tiled, deep and multi-part EXR files are not read here; rayproof report view reads what OpenEXR does`);
    let at = 8;
    const text = () => { const end = bytes.indexOf(0, at), found = new TextDecoder().decode(bytes.subarray(at, end)); at = end + 1; return found; };
    const header = {};
    for (let key = text(); key; key = text()) {
      text();
      const size = view.getInt32(at, true);
      header[key] = at + 4;
      at += 4 + size;
    }
    const compression = bytes[header.compression];
    if (![0, ZIPS, ZIP].includes(compression)) throw new Error(`${name}: its compression is not read here; rayproof report view reads what OpenEXR does`);
    const [left, top, right, bottom] = [0, 4, 8, 12].map((offset) => view.getInt32(header.dataWindow + offset, true));
    const width = right - left + 1, height = bottom - top + 1, rows = compression === ZIP ? 16 : 1;
    const listed = [];
    let offsets = at;
    for (at = header.channels; bytes[at];) {
      const channel = text();
      listed.push([channel, view.getInt32(at, true)]);
      if (view.getInt32(at + 8, true) !== 1 || view.getInt32(at + 12, true) !== 1) throw new Error(`${name}: channels of other sizes are not read here`);
      at += 16;
    }
    if (!(width > 0 && height > 0 && width * height <= 2 ** 26)) throw new Error(`${name}: ${width} x ${height} pixels are not read`);
    const channels = new Map(listed.map(([channel]) => [channel, new Float32Array(width * height)]));
    const line = listed.reduce((sum, [, type]) => sum + SIZES[type] * width, 0);
    for (let first = 0; first < height; first += rows, offsets += 8) {
      const start = Number(view.getBigUint64(offsets, true)), size = view.getInt32(start + 4, true);
      const count = Math.min(rows, height - first), packed = bytes.subarray(start + 8, start + 8 + size);
      // What does not become smaller is kept as it is.
      const plain = compression && size < count * line ? await inflated(packed) : packed;
      const data = new DataView(plain.buffer, plain.byteOffset, plain.byteLength);
      let place = 0;
      for (let y = first; y < first + count; y += 1) {
        for (const [channel, type] of listed) {
          const into = channels.get(channel);
          for (let x = 0; x < width; x += 1, place += SIZES[type]) into[y * width + x] = numberAt(data, place, type);
        }
      }
    }
    return { name, width, height, channels };
  }

  function pfm(name, buffer) {
    const head = /^(PF|Pf)\s+(\d+)\s+(\d+)\s+([-+.\deE]+)\s/.exec(new TextDecoder("latin1").decode(buffer.slice(0, 200)));
    if (!head) throw new Error(`${name}: it begins like a PFM and has no header of one`);
    const [width, height] = [Number(head[2]), Number(head[3])], names = head[1] === "PF" ? ["R", "G", "B"] : ["Y"];
    const view = new DataView(buffer, head[0].length), little = Number(head[4]) < 0;
    if (view.byteLength < 4 * names.length * width * height) throw new Error(`${name}: holds less than its header says`);
    const channels = new Map(names.map((one) => [one, new Float32Array(width * height)]));
    for (let y = height - 1, at = 0; y >= 0; y -= 1) { // from the lowest row up
      for (let x = 0; x < width; x += 1) for (const one of names) { channels.get(one)[y * width + x] = view.getFloat32(at, little); at += 4; }
    }
    return { name, width, height, channels };
  }

  // By the sRGB curve to linear light, as `rayproof report view` reads a PNG.
  const linear = (code) => { const value = code / 255; return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4; };

  async function picture(name, file) {
    const bitmap = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    const { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, width, height);
    const plane = (c) => Float32Array.from({ length: width * height }, (_, i) => linear(data[4 * i + c]));
    return { name, width, height, channels: new Map([["R", plane(0)], ["G", plane(1)], ["B", plane(2)]]) };
  }

  rayproof.readImage = async function (file) {
    const buffer = await file.arrayBuffer(), magic = new Uint8Array(buffer.slice(0, 4));
    try {
      if (magic[0] === 0x76 && magic[1] === 0x2f && magic[2] === 0x31 && magic[3] === 1) return await exr(file.name, buffer);
      if (magic[0] === 0x50 && (magic[1] | 0x20) === 0x66) return pfm(file.name, buffer);
      return await picture(file.name, file);
    } catch (error) {
      throw error instanceof RangeError || error instanceof DOMException || error instanceof TypeError ? new Error(`${file.name}: cannot be read as an image`) : error;
    }
  };

  const ORDER = "RGBXYZUV";
  const place = (one) => { const at = ORDER.indexOf(one); return at < 0 ? ORDER.length : at; };

  // Channels as layers: what stands before the last dot names one. -> Map of layer -> {width, height, channels, values, titles}
  rayproof.layers = function ({ width, height, channels }) {
    const layers = new Map();
    for (const name of channels.keys()) {
      const dot = name.lastIndexOf("."), last = name.slice(dot + 1);
      const base = dot < 0 ? "" : name.slice(0, dot);
      if (last === "low" && channels.has(base)) continue; // what `rayproof render --double` lost in rounding
      const layer = last === "A" ? [base, "alpha"].filter(Boolean).join(" ") : base || (ORDER.slice(0, 3).includes(last) || last === "Y" ? "colour" : last);
      if (!layers.has(layer)) layers.set(layer, []);
      layers.get(layer).push([last, name]);
    }
    return new Map([...layers].map(([layer, found]) => {
      found.sort(([a], [b]) => place(a) - place(b) || (a < b ? -1 : 1));
      const values = new Float32Array(width * height * found.length);
      found.forEach(([, name], c) => channels.get(name).forEach((value, i) => { values[i * found.length + c] = value; }));
      return [layer, { width, height, channels: found.length, values, titles: found.map(([last]) => last) }];
    }));
  };

  // Two images of any files in the viewer; others are opened or dropped into the page.

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
      document.title = [mine, other].filter(Boolean).join(" and ");
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
    rayproof.replace(value, `${x}, ${y}: ${mine}: ${at(a)} · ${other}: ${at(b)}`);
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
