// A case's data: a script added when the case is opened, since browsers refuse fetch() on file://.
(function (rayproof) {
  "use strict";

  const MOST_KEPT = 12; // cases; the rest is loaded again when wanted
  const waiting = new Map();
  const loaded = new Map();

  rayproof.receive = function (number, record, images) {
    waiting.get(number)?.({ record, images });
  };

  function request(row) {
    return new Promise((resolve, reject) => {
      const script = document.createElement("script");
      const finish = (act, value) => { waiting.delete(row.number); script.remove(); act(value); };
      waiting.set(row.number, (data) => finish(resolve, data));
      script.onerror = () => finish(reject, new Error(`${row.file} is missing beside index.html`));
      script.src = row.file;
      document.head.append(script);
    });
  }

  async function open(row) {
    const { record, images } = await request(row);
    const data = JSON.parse(await rayproof.inflateText(record));
    const decoded = new Map();
    const image = (renderer, stage) => {
      const key = `${renderer}\n${stage}`;
      const stored = Object.hasOwn(images, renderer) ? images[renderer][stage] : undefined;
      if (!stored) return Promise.resolve(null);
      if (!decoded.has(key)) {
        decoded.set(key, (async () => {
          const base = stored.against ? await image(data.base, stage) : null;
          return { width: stored.width, height: stored.height, channels: stored.channels,
            values: await rayproof.floats(stored, base && base.values) };
        })());
      }
      return decoded.get(key);
    };
    return { ...data, renderers: Object.keys(images), image,
      has: (renderer, stage) => Object.hasOwn(images, renderer) && Object.hasOwn(images[renderer], stage) };
  }

  // -> Promise of the case's record, with image(renderer, stage) -> Promise of an image or null.
  rayproof.load = function (row) {
    if (!loaded.has(row.number)) {
      loaded.set(row.number, open(row));
      loaded.get(row.number).catch(() => loaded.delete(row.number));
      if (loaded.size > MOST_KEPT) loaded.delete(loaded.keys().next().value);
    }
    return loaded.get(row.number);
  };
})(window.rayproof);
