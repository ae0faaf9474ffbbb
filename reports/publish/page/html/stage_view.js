// One stage of a case on the screen: chosen renderers, painted images, errors with their bar and histogram.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  const configurationOf = (renderer) => (renderer.startsWith("tracer-") ? renderer.slice(7) : renderer);
  rayproof.configurationOf = configurationOf;

  // The images of a stage as bitmaps; what was painted alike the last time is not painted again.
  function painter() {
    const kept = new Map();
    return function (key, make) {
      if (!kept.has(key)) {
        kept.set(key, make());
        if (kept.size > 12) kept.delete(kept.keys().next().value);
      }
      return kept.get(key);
    };
  }

  const comparable = (a, b) => a && b && a.width === b.width && a.height === b.height && a.channels === b.channels;

  // -> {controls, node, viewer, draw(stage, mine, other, a, b, settings)}
  rayproof.stageView = function (data, { ours, theirs, set, onpoint, onview }) {
    const viewer = rayproof.viewer({ onpoint, onview });
    const controls = e("div"), below = e("div"), swatches = legend();
    const once = painter();
    const numbers = new Map(); // objects by number, for keys
    const keyOf = (image) => { if (!numbers.has(image)) numbers.set(image, numbers.size); return numbers.get(image); };
    const counts = data.mask ? rayproof.edgeCounts(data.mask) : [];
    const edges = data.mask ? rayproof.bitmap(rayproof.paintEdges(data.mask, data.masks.width, data.masks.height)) : null;

    function limitOf(stage, mine, other, metric) {
      if (metric !== "absolute" && metric !== "signed") return null;
      const check = (data.checks || []).find((one) => one.stage === stage && one.configuration === configurationOf(mine) && one.reference === other);
      const limit = rayproof.number(check?.end_to_end?.limit);
      return limit > 0 && Number.isFinite(limit) ? limit : null;
    }

    function draw(stage, mine, other, a, b, settings) {
      const name = stage.name, unit = stage.unit === "1" ? "" : stage.unit;
      const both = comparable(a, b);
      // The classes of pixels are one configuration's: over another's images they would say what nobody judged by.
      const own = configurationOf(mine || "") === data.masks?.configuration;
      const channel = settings.channel < (a || b)?.channels ? settings.channel : -1;
      const noFlip = both ? rayproof.noFlip(name, a) : null;
      const refused = noFlip && settings.metric === "flip" ? `FLIP is ${noFlip} \u00B7 ` : "";
      settings = { ...settings, channel, edges: own && settings.edges, mode: both ? settings.mode : "side", metric: refused ? "absolute" : settings.metric };
      // A slider that is being dragged stays: it changes nothing but itself and the images.
      const alike = JSON.stringify([{ ...settings, exposure: 0, pixel: 0, zoom: 0 }, name, mine, other, Boolean(both)]);
      const held = controls.contains(document.activeElement) && document.activeElement.type === "range";
      if (!(held && alike === controls.dataset.alike)) rayproof.replace(controls, a || b ? rayproof.toolbar(settings, { ours, theirs, mine, other, stage: name, both,
        channels: [[-1, "all channels"], ...(data.channels[name] || []).map((title, i) => [i, title])],
        counts: own ? counts : [], noFlip }, set, viewer) : choosers(mine, other));
      controls.dataset.alike = alike;
      if (!a && !b) {
        rayproof.replace(viewer.node, e("p", { class: "muted" }, name === "camera"
          ? "The camera stage is matrices, not an image; the checks below compare them." : "No image of this stage was kept."));
        rayproof.replace(below);
        swatches.hidden = true;
        return;
      }
      swatches.hidden = false;
      const scale = once(`scale ${keyOf(b || a)}`, () => rayproof.scaleOf(name, b || a));
      const look = JSON.stringify([channel, settings.exposure, settings.gamma, settings.map]);
      const paint = (image) => (image ? once(`${keyOf(image)} ${keyOf(b || a)} ${look}`, () => rayproof.bitmap(rayproof.paint(name, image, scale, settings))) : null);
      const errors = both ? once(`errors ${keyOf(a)} ${keyOf(b)} ${channel} ${settings.metric}`, () =>
        rayproof.errors(settings.metric, a, b, channel, { compress: rayproof.hasExposure(name) })) : null;
      const auto = errors && rayproof.autoRange(errors, settings.log);
      let range = errors && [settings.log ? settings.low ?? auto[0] : 0, settings.high ?? auto[1]];
      if (errors && !(range[0] < range[1])) range = [settings.log ? range[1] / 10 : 0, range[1]];
      const limit = errors ? limitOf(name, mine, other, settings.metric) : null;
      const errorUnit = { absolute: unit, signed: unit, squared: unit ? `(${unit})\u00B2` : "", ulp: "ulp", relative: "relative", ssim: "1 \u2212 SSIM", flip: "HDR-FLIP" }[settings.metric];
      const bitmaps = { ours: paint(a), theirs: paint(b), edges,
        error: errors && once(`error ${keyOf(a)} ${keyOf(b)} ${channel} ${settings.metric} ${range} ${settings.log} ${settings.colors}`, () =>
          rayproof.bitmap(rayproof.paintErrors(errors, range, settings.log, settings.colors))) };
      const shown = rayproof.hasExposure(name) ? `white = ${rayproof.short(scale.white / 2 ** settings.exposure)} ${unit}` : span(name, scale, unit);
      const unanswered = (data.unsupported || []).find((item) => item.reference === other && item.stage === name);
      viewer.show({ settings, mask: data.mask, ours: a, theirs: b, bitmaps, errors, names: { ours: mine, theirs: other },
        notes: { ours: mine, theirs: [other, shown].filter(Boolean).join(" \u00B7 "), error: errors && refused + worst(errors, errorUnit) },
        foot: errors && rayproof.colorBar({ errors, range, log: settings.log, map: settings.colors, unit: errorUnit, limit,
          onrange: (low, high) => set({ low: low ?? "", high: high ?? "" }) }),
        why: { ours: "No image of this stage was kept.", theirs: unanswered ? unanswered.why : "This reference did not answer this stage.",
          error: a && b ? "The images differ in size." : "There is nothing to compare." } });
      rayproof.replace(below, errors ? rayproof.histogramView(errors, range, settings.log, limit) : null);
    }

    const choosers = (mine, other) => e("div", { class: "controls" },
      ours.length ? rayproof.select("ours", ours.map((name) => [name, name]), mine, (value) => set({ ours: value })) : null,
      theirs.length ? rayproof.select("reference", theirs.map((name) => [name, name]), other, (value) => set({ reference: value })) : null);

    return { controls, node: e("div", {}, viewer.node, below, swatches), viewer, draw };
  };

  const worst = (errors, unit) => (errors.differing
    ? `worst ${rayproof.short(errors.worst)} ${unit} at ${errors.at.join(", ")} \u00B7 ${errors.differing} of ${errors.values.length} pixels differ`
    : "not one pixel differs");

  function span(stage, scale, unit) {
    if (stage !== "distance") return "";
    const [low, high] = scale.ranges[0];
    return low <= high ? `${rayproof.short(low)} to ${rayproof.short(high)} ${unit}` : "no hit";
  }

  const legend = () => e("p", { class: "muted legend" }, [["nan", "NaN"], ["inf", "infinity"], ["miss", "miss"], ["zero", "no error"]].map(([name, words]) =>
    [e("i", { class: `swatch ${name}` }), words, " "]), " \u00B7 errors are of the stored float32 values; the checks were judged on what the renderers returned");
})(window.rayproof);
