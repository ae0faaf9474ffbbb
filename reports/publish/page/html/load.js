// A case's data: scripts added when the case is opened, since browsers refuse fetch() on file://; a page
// that is a single file holds them itself.
(function (rayproof) {
  "use strict";

  const MOST_KEPT = 12; // cases; the rest is loaded again when wanted
  const waiting = new Map();
  const loaded = new Map();

  rayproof.receive = (path, content) => waiting.get(path)?.(content);

  // -> Promise of the content that the script at `path` hands over
  rayproof.request = function (path) {
    const inlined = rayproof.inlined(path);
    if (inlined) return Promise.resolve(JSON.parse(inlined.textContent));
    return new Promise((resolve, reject) => {
      const script = document.createElement("script");
      const finish = (act, value) => { waiting.delete(path); script.remove(); act(value); };
      waiting.set(path, (content) => finish(resolve, content));
      script.onerror = () => finish(reject, new Error(`${path} is missing beside index.html`));
      script.src = rayproof.place(path);
      document.head.append(script);
    });
  };

  async function open(row) {
    const data = rayproof.expanded(JSON.parse(await rayproof.inflateText(await rayproof.request(row.file))));
    const { base, renderers: images } = data.pixels ? await rayproof.request(data.pixels) : { base: null, renderers: {} };
    const decoded = new Map();
    const has = (renderer, stage) => Object.hasOwn(images, renderer) && Object.hasOwn(images[renderer], stage);
    const image = (renderer, stage) => {
      if (!has(renderer, stage)) return Promise.resolve(null);
      const key = JSON.stringify([renderer, stage]);
      if (!decoded.has(key)) {
        decoded.set(key, (async () => {
          const stored = images[renderer][stage];
          const { width, height, channels } = stored;
          const prediction = await rayproof.predict(stored, stage, renderer, base, image);
          return { width, height, channels, values: await rayproof.floats(stored, prediction) };
        })());
      }
      return decoded.get(key);
    };
    const mask = data.masks ? await rayproof.inflate(data.masks.data) : null;
    return { ...data, renderers: Object.keys(images), image, has, mask };
  }

  // -> Promise of the case's record, with image(renderer, stage) -> Promise of an image or null, and mask: Uint8Array.
  rayproof.load = function (row) {
    if (!loaded.has(row.file)) {
      loaded.set(row.file, open(row));
      loaded.get(row.file).catch(() => loaded.delete(row.file));
      if (loaded.size > MOST_KEPT) loaded.delete(loaded.keys().next().value);
    }
    return loaded.get(row.file);
  };
})(window.rayproof);
