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
    const counts = data.mask ? rayproof.explainedCounts(data.mask) : [];
    const explained = data.mask ? rayproof.bitmap(rayproof.paintExplained(data.mask, data.masks.width, data.masks.height)) : null;

    function limitOf(stage, mine, other, metric) {
      if (metric !== "absolute" && metric !== "signed") return null;
      const check = (data.checks || []).find((one) => one.stage === stage && one.configuration === configurationOf(mine) && one.reference === other);
      const limit = rayproof.number((rayproof.worstOf?.(check) || check?.end_to_end)?.limit);
      return limit > 0 && Number.isFinite(limit) ? limit : null;
    }

    function draw(stage, mine, other, a, b, settings) {
      const name = stage.name, unit = stage.unit === "1" ? "" : stage.unit;
      const both = comparable(a, b);
      // The explanations are of one configuration's pixels: over another's images they would say what nobody judged.
      const own = configurationOf(mine || "") === data.masks?.configuration;
      const channel = settings.channel < (a || b)?.channels ? settings.channel : -1;
      const noFlip = both ? rayproof.noFlip(name, a) : null;
      const refused = noFlip && settings.metric === "flip" ? `FLIP is ${noFlip} \u00B7 ` : "";
      settings = { ...settings, channel, explained: own && settings.explained, mode: both ? settings.mode : "side", metric: refused ? "absolute" : settings.metric };
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
      const bitmaps = { ours: paint(a), theirs: paint(b), explained,
        error: errors && once(`error ${keyOf(a)} ${keyOf(b)} ${channel} ${settings.metric} ${range} ${settings.log} ${settings.colors}`, () =>
          rayproof.bitmap(rayproof.paintErrors(errors, range, settings.log, settings.colors))) };
      const shown = rayproof.hasExposure(name) ? `white = ${rayproof.short(scale.white / 2 ** settings.exposure)} ${unit}` : span(name, scale, unit);
      const unanswered = (data.unsupported || []).find((item) => item.reference === other && item.stage === name);
      viewer.show({ settings, mask: data.mask, ours: a, theirs: b, bitmaps, errors, names: { ours: mine, theirs: rayproof.reference(other) },
        notes: { ours: mine, theirs: [rayproof.reference(other), shown].filter(Boolean).join(" \u00B7 "), error: errors && refused + worst(errors, errorUnit) },
        foot: errors && rayproof.colorBar({ errors, range, log: settings.log, map: settings.colors, unit: errorUnit, limit,
          onrange: (low, high) => set({ low: low ?? "", high: high ?? "" }) }),
        why: { ours: "No image of this stage was kept.", theirs: unanswered ? unanswered.why : "This reference did not answer this stage.",
          error: a && b ? "The images differ in size." : "There is nothing to compare." } });
      rayproof.replace(below, errors ? rayproof.histogramView(errors, range, settings.log, limit, errorUnit) : null);
    }

    const choosers = (mine, other) => e("div", { class: "controls" },
      ours.length ? rayproof.select("ours", ours.map((name) => [name, name]), mine, (value) => set({ ours: value })) : null,
      theirs.length ? rayproof.select("reference", theirs.map((name) => [name, rayproof.reference(name)]), other, (value) => set({ reference: value })) : null);

    return { controls, node: e("div", {}, viewer.node, below, swatches), viewer, draw };
  };

  // What decides is the error over its own limit; the largest error may be another pixel's, and decides nothing.
  const worst = (errors, unit) => (errors.differing
    ? `largest error${errors.each ? " of a channel" : ""} ${rayproof.short(errors.worst)} ${unit} at ${errors.at.join(", ")} \u00B7 ${errors.differing} of ${errors.values.length} pixels differ`
    : "not one pixel differs");

  function span(stage, scale, unit) {
    if (stage !== "distance") return "";
    const [low, high] = scale.ranges[0];
    return low <= high ? `${rayproof.short(low)} to ${rayproof.short(high)} ${unit}` : "no hit";
  }

  const legend = () => e("p", { class: "muted legend" }, [["nan", "NaN"], ["inf", "infinity"], ["miss", "miss"], ["zero", "no error"]].map(([name, words]) =>
    [e("i", { class: `swatch ${name}` }), words, " "]), " \u00B7 errors are of the stored float32 values; the checks were judged on what the renderers returned");

  // One pixel's whole story: every stage of every renderer, to the last bit, and the command that tells it again.
  // -> {node, show(x, y)}; `renderers` in order, the first of them ours, the second the reference compared with.
  rayproof.inspector = function (data, stages) {
    const body = e("tbody"), head = e("thead"), table = e("table", {}, head, body);
    const title = e("span", { class: "muted", role: "status" }, "point at an image, or use the arrow keys on one");
    const kinds = e("p", { class: "muted kinds" });
    const command = e("div");
    const node = e("section", { class: "panel inspector", "aria-label": "Pixel" }, e("h3", {}, "Pixel ", title), command, kinds,
      rayproof.wide("every stage of every renderer", table));
    let images = null, wanted = null, context = { renderers: data.renderers, ours: "", theirs: "", stage: "", metric: "absolute" };

    const read = () => Promise.all(stages.map((stage) => Promise.all(data.renderers.map((renderer) => data.image(renderer, stage.name)))));

    function rows(stage, found, x, y) {
      const byName = new Map(data.renderers.map((name, i) => [name, found[i]]));
      const first = found.find(Boolean);
      if (!first || x >= first.width || y >= first.height) return [];
      const names = data.channels[stage.name] || [];
      const { renderers, ours, theirs } = context;
      const value = (name, channel) => {
        const image = byName.get(name);
        return image && channel < image.channels && x < image.width && y < image.height ? image.values[(y * image.width + x) * image.channels + channel] : null;
      };
      return Array.from({ length: first.channels }, (_, channel) => {
        const [mine, other] = [value(ours, channel), value(theirs, channel)];
        const both = mine !== null && other !== null;
        const gap = both ? rayproof.distance(context.metric, mine, other) : null;
        return e("tr", { class: stage.name === context.stage ? "current" : "" },
          e("th", { scope: "row" }, channel ? e("span", { class: "offscreen" }, stage.name) : stage.name,
            e("span", { class: "muted" }, names[channel] === stage.name ? "" : ` ${names[channel] ?? channel}`)),
          renderers.map((name) => {
            const one = value(name, channel);
            return e("td", { class: "figure", "data-renderer": name, "data-stage": stage.name, "data-channel": channel }, one === null ? "" : rayproof.exact(one));
          }),
          e("td", { class: `figure${gap ? " differs" : ""}` }, both ? rayproof.short(gap) : ""));
      });
    }

    // Ours and the reference chosen come first, then everybody else.
    function set(more) {
      context = { ...context, ...more };
      context.metric = rayproof.ofValues(context.metric);
      const chosen = [context.ours, context.theirs].filter((name) => data.renderers.includes(name));
      context.renderers = [...new Set([...chosen, ...data.renderers])];
      rayproof.replace(head, e("tr", {}, e("th", { scope: "col" }, "stage"), context.renderers.map((name) => e("th", { scope: "col" }, rayproof.parts(rayproof.reference(name)))),
        e("th", { scope: "col" }, `${context.metric} error`)));
      if (wanted) show(...wanted);
    }

    async function show(x, y) {
      wanted = [x, y];
      if (!images) images = await read();
      if (wanted[0] !== x || wanted[1] !== y) return;
      rayproof.replace(title, `column ${x}, row ${y}`);
      rayproof.replace(command, rayproof.command(rayproof.probeCommand(data, x, y, context.ours)));
      const own = rayproof.configurationOf(context.ours || "") === data.masks?.configuration;
      const explanation = own ? rayproof.explanationAt(data.mask, data.masks.width, x, y) : undefined;
      rayproof.replace(kinds, explanation ? `This pixel is over its limit, and its value is ${explanation.name}.` : "");
      rayproof.replace(body, stages.map((stage, i) => rows(stage, images[i], x, y)));
    }
    return { node, show, set };
  };

  // With the subject, or the tracer's configuration that is looked at where it is none of the two that are always shown.
  rayproof.probeCommand = function (data, x, y, ours) {
    const [before, subject] = data.probe, own = String(ours || "").startsWith("tracer-") ? configurationOf(ours) : "";
    return `${before} ${x} ${y}${subject}${subject || ["", "float32", "float64"].includes(own) ? "" : ` --configuration ${rayproof.quoted(own)}`}`;
  };

  // A shell word: quoted where a shell would read anything into it.
  rayproof.quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);
})(window.rayproof);
