// A case's record and images, loaded when the case is opened.
(function (rayproof) {
  "use strict";

  // In a report that is a single file, what else lies beside the page is in it: elements named by their paths.

  // Where a file of the results folder is, for src and href. No segment of a path is markup or a scheme.
  rayproof.place = (path) => `./${path.split("/").map(encodeURIComponent).join("/")}`;

  rayproof.inlined = (path) => document.querySelector(`script[data-path="${CSS.escape(path)}"]`);

  // -> Promise of a text that the page holds deflated
  rayproof.unfolded = (path) => rayproof.inflateText(rayproof.inlined(path).textContent);

  // What an image's src is.
  rayproof.source = function (path) {
    const held = rayproof.inlined(path);
    return held ? `data:${held.dataset.type};base64,${held.textContent}` : rayproof.place(path);
  };

  // The inverse of reports/results/compact.py: what the checks of a case have in common goes back into each of them.

  const COUNTS = ["wrong", "explained", "hit_miss", "nan", "inf"];
  const NUMBERS = ["worst_ratio", "worst_error", "limit", "ulp"];
  const KINDS = ["wide", "rounding", "epsilon", "wrong", "unexamined"];

  const zeros = (names) => Object.fromEntries(names.map((name) => [name, 0]));
  const completed = (measured, pixels) => (measured ? { interior: pixels, ...zeros(COUNTS), ...zeros(NUMBERS), pixel: [0, 0], ...measured } : null);
  // An empty one is the same as end to end.
  const continued = (check) => (check.continued && !Object.keys(check.continued).length ? check.end_to_end : check.continued);

  const examined = (counts, pixels) => {
    if (!counts) return counts;
    const every = { pixels, ...zeros(KINDS), ...counts };
    return { ...every, strict: every.pixels - KINDS.reduce((sum, name) => sum + every[name], 0) };
  };

  // A matrix by its upper half, without the numbers of differing pixels, which are 0.
  const square = (matrix) => {
    const half = matrix.ratio;
    if (!half || !half.length || "differing" in matrix) return matrix;
    const ratio = !half.every((row, place) => row.length === half.length - place) ? half
      : half.map((_, i) => half.map((__, j) => half[Math.min(i, j)][Math.abs(i - j)]));
    return { ...matrix, ratio, differing: ratio.map((row) => row.map((value) => (value === null ? null : 0))) };
  };

  // [{configuration, reference, stages: {ray: check}}] -> [check with these three and what is usual]
  const ungrouped = (groups, because, pixels) => groups.flatMap((group) =>
    Object.entries(group.stages).map(([stage, check]) => ({
        configuration: group.configuration, reference: group.reference, stage, verdict: "pass",
        because: because[group.reference]?.[stage], ...check, examined: examined("examined" in check ? check.examined : {}, pixels) })));

  rayproof.expanded = function ({ derivations = [], because = {}, ...record }) {
    const pixels = (record.width || 0) * (record.height || 0);
    const checks = ungrouped(record.checks || [], because, pixels).map((check) => ({ reason: "", ratio: check.end_to_end?.worst_ratio || 0, ...check,
      because: typeof check.because === "number" ? derivations[check.because] || "" : check.because,
      end_to_end: completed(check.end_to_end, pixels), continued: completed(continued(check), pixels) }));
    const adjudication = record.adjudication && Object.fromEntries(Object.entries(record.adjudication).map(([stage, matrix], _, [[, first]]) => [stage, square({
      ...("baseline" in first ? { baseline: first.baseline } : {}), ...("renderers" in first ? { renderers: first.renderers } : {}), ...matrix })]));
    const renders = record.renders && record.renders.map((render) => ({ error: null, cached: false, ...render }));
    return { ...record, ...(renders ? { renders } : {}), ...(adjudication ? { adjudication } : {}), checks };
  };

  // A case's data: scripts added when the case is opened, since browsers refuse fetch() on file://; a page
  // that is a single file holds them itself.

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

  // -> Promise of the same that is not kept: for one look at each of many cases
  rayproof.glance = open;

  // Whoever is not a reference of this run was put to the test, whatever its name. -> {ours, theirs}: names of renderers
  rayproof.sides = function (results, data) {
    const witnesses = new Set([...Object.keys(results.references || {}), ...Object.values(results.comparison?.renderers || {}), ...(data.checks || []).map((check) => check.reference)]);
    return { ours: data.renderers.filter((name) => !witnesses.has(name)), theirs: data.renderers.filter((name) => witnesses.has(name)) };
  };

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
