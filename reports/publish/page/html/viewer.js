// Ours, a reference and their difference: side by side, swiped, flickering, one through the other, or the error alone.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const TITLES = { side: "side by side", swipe: "swipe", flicker: "flicker", onion: "onion skin", error: "error only" };
  const BEAT = 600; // ms that each image of a flicker stays
  rayproof.modeTitle = (mode) => TITLES[mode];

  const calm = () => window.matchMedia("(prefers-reduced-motion: reduce)").matches;

  // -> {node, show(what), look(view), point(x, y), zoom(factor), fit(), legible(), toggle(), share()}
  // onpoint(x, y): a pixel was pointed at; onview(): the zoom changed.
  rayproof.viewer = function ({ onpoint, onview }) {
    const shared = { image: { width: 1, height: 1 }, view: { zoom: 1, x: 0.5, y: 0.5 }, pixel: null, pinned: false };
    const panes = { ours: rayproof.pane("image of ours"), reference: rayproof.pane("image of the reference"), both: rayproof.pane("both images"), error: rayproof.pane("image of the errors") };
    const node = e("div", { class: "panes" });
    const share = e("input", { type: "range", min: 0, max: 1, step: 0.01, value: 0.5, "aria-label": "share of ours", oninput: () => redraw() });
    const play = e("button", { class: "quiet", onclick: () => { playing = !playing; tick(); } });
    let shown = null, front = false, playing = true, timer = 0, frame = 0;

    const redraw = () => {
      cancelAnimationFrame(frame);
      frame = requestAnimationFrame(paint);
    };
    const point = (x, y) => {
      shared.pixel = [x, y];
      redraw();
      onpoint(x, y);
    };
    for (const pane of Object.values(panes)) rayproof.pointing(pane, shared, { change: () => { redraw(); onview(shared.view); }, point });

    const text = (image, channel) => (x, y) => {
      const at = (y * image.width + x) * image.channels;
      if (channel >= 0) return [rayproof.short(image.values[at + channel], 5)];
      return Array.from(image.values.subarray(at, at + image.channels), (value) => rayproof.short(value, 5));
    };

    const letters = (x, y) => {
      const explanation = rayproof.explanationAt(shown.mask, shown.bitmaps.explained.width, x, y);
      return explanation ? [explanation.letter] : [];
    };

    function paint() {
      if (!shown || !node.isConnected) return;
      const { bitmaps, ours, theirs, errors, settings } = shown;
      const base = { image: shared.image, view: shared.view, pixel: shared.pixel };
      const over = bitmaps.explained && settings.explained ? [{ bitmap: bitmaps.explained }] : [];
      // Where the overlay hides the colour, its letter stands beside the numbers.
      const told = (words) => (over.length ? (x, y) => [...words(x, y), ...letters(x, y)] : words);
      const single = (pane, bitmap, words) => bitmap && pane.draw({ ...base, layers: [{ bitmap }, ...over], text: told(words) });
      const mine = ours && text(ours, settings.channel), other = theirs && text(theirs, settings.channel);
      const part = Number(share.value);
      if (settings.mode === "side") {
        single(panes.reference, bitmaps.theirs, other);
        single(panes.ours, bitmaps.ours, mine);
      } else if (settings.mode === "flicker") {
        const now = front || !bitmaps.theirs ? bitmaps.ours : bitmaps.theirs;
        single(panes.both, now, now === bitmaps.ours ? mine : other);
        panes.both.caption(now === bitmaps.ours ? "ours" : "reference", now === bitmaps.ours ? shown.names.ours : shown.names.theirs);
      } else if (settings.mode === "swipe") {
        panes.both.draw({ ...base, divider: part, text: null,
          layers: [{ bitmap: bitmaps.ours, to: part }, { bitmap: bitmaps.theirs, from: part }, ...over] });
      } else if (settings.mode === "onion") {
        panes.both.draw({ ...base, text: null, layers: [{ bitmap: bitmaps.theirs }, { bitmap: bitmaps.ours, alpha: part }, ...over] });
      }
      if (errors) single(panes.error, bitmaps.error, (x, y) => [rayproof.short(errors.values[y * errors.width + x], 3)]);
    }

    function tick() {
      clearTimeout(timer);
      rayproof.replace(play, playing ? "pause" : "play");
      play.setAttribute("aria-label", playing ? "pause the flicker" : "play the flicker");
      if (!playing || shown?.settings.mode !== "flicker" || !node.isConnected) return;
      timer = setTimeout(() => { front = !front; redraw(); tick(); }, BEAT);
    }

    const absent = (title, why) => e("figure", { class: "pane" }, e("figcaption", {}, e("strong", {}, title)), e("div", { class: "frame absent" }, why));

    // what: {settings, ours, theirs, names, notes, bitmaps, mask, errors, why, foot}
    function show(what) {
      const first = !shown;
      shown = what;
      const image = what.theirs || what.ours;
      const same = image.width === shared.image.width && image.height === shared.image.height;
      shared.image = { width: image.width, height: image.height };
      if (!same || first) shared.view = rayproof.fitted(image);
      const { mode } = what.settings;
      panes.reference.caption("reference", rayproof.parts(what.notes.theirs));
      panes.ours.caption("ours", rayproof.parts(what.notes.ours));
      panes.error.caption(`${rayproof.metricTitle(what.settings.metric)} error`, what.notes.error);
      panes.both.caption(TITLES[mode], `${what.names.ours} over ${what.names.theirs}`);
      share.dir = mode === "onion" ? "rtl" : "ltr"; // the end of the slider that shows ours alone is the left one
      rayproof.replace(panes.both.foot, mode === "flicker" ? play : e("label", { class: "share" }, e("span", {}, "ours"), share, e("span", {}, "reference")));
      rayproof.replace(panes.error.foot, what.foot);
      const pair = what.ours && what.theirs && what.errors;
      const error = what.errors ? panes.error.node : absent("error", what.why.error);
      const parts = mode === "error" && what.errors ? [error]
        : mode !== "side" && pair ? [panes.both.node, error]
        : [what.ours ? panes.ours.node : absent("ours", what.why.ours),
          what.theirs ? panes.reference.node : absent("reference", what.why.theirs), error];
      node.dataset.panes = parts.length;
      // Frames as high as their width makes them, yet never beyond the window.
      node.style.setProperty("--aspect", `${image.width} / ${image.height}`);
      const held = document.activeElement;
      rayproof.replace(node, parts);
      if (node.contains(held)) held.focus();
      if (calm()) playing = false;
      tick();
      paint();
    }

    const middle = () => {
      const frame = active().frame();
      if (!shared.pixel) return [frame.width / 2, frame.height / 2];
      const place = rayproof.placed(shared.view, shared.image, frame);
      return [place.left + (shared.pixel[0] + 0.5) * place.scale, place.top + (shared.pixel[1] + 0.5) * place.scale];
    };
    const active = () => Object.values(panes).find((pane) => pane.node.isConnected) || panes.error;
    const look = (view) => { shared.view = view; redraw(); onview(view); };

    // Zoom about the marked pixel, and bring it to the middle when it is enlarged.
    const zoom = (factor) => {
      const room = active().frame();
      const view = rayproof.zoomed(shared.view, shared.image, room, factor, middle());
      look(shared.pixel ? rayproof.kept({ ...view, x: shared.pixel[0] + 0.5, y: shared.pixel[1] + 0.5 }, shared.image, room) : view);
    };

    new ResizeObserver(redraw).observe(node);
    return {
      node, show, zoom, point: (x, y) => { shared.pinned = true; point(x, y); },
      mark: (x, y) => { shared.pixel = [x, y]; redraw(); },
      unpin: () => { const was = shared.pinned; shared.pinned = false; return was; },
      fit: () => look(rayproof.fitted(shared.image)),
      legible: () => zoom(rayproof.zoomFor(64, shared.image, active().frame()) / shared.view.zoom),
      restore: (level) => level > 1 && zoom(level / shared.view.zoom),
      toggle: () => { playing = false; front = !front; tick(); redraw(); },
      slide: (step) => { share.value = Number(share.value) + step; redraw(); },
      shared,
    };
  };

  // The colour bar of the error image: its range, choosable, and where the limit lies on it.
  function bar(signed, map) {
    const canvas = e("canvas", { width: 256, height: 1, class: "colorbar", "aria-hidden": "true" });
    const picture = new ImageData(256, 1);
    for (let i = 0; i < 256; i += 1) picture.data.set([...rayproof.mapped(signed ? "signed" : map, i / 255), 255], 4 * i);
    canvas.getContext("2d", { willReadFrequently: true }).putImageData(picture, 0, 0);
    return canvas;
  }

  // onrange(low, high): numbers, or null for the automatic end.
  rayproof.colorBar = function ({ errors, range, log, map, unit, limit, onrange }) {
    const signed = rayproof.isSigned(errors.metric);
    const field = (title, value, act) => e("input", { type: "text", inputmode: "decimal", size: 8, "aria-label": title, value: rayproof.short(value, 3),
      onchange: (event) => act(Number(event.target.value) > 0 ? Number(event.target.value) : null) });
    const [low, high] = range;
    const at = limit === null ? null : rayproof.position(limit, range, log);
    const place = signed ? 0.5 + at / 2 : at;
    const mark = e("i", { class: "limit-mark", title: limit === null ? "" : `limit of the deciding pixel: ${rayproof.short(limit)}` });
    if (at !== null) mark.style.left = `${100 * place}%`;
    return e("div", { class: "scale" },
      e("div", { class: "bar-holder" }, bar(signed, map), at !== null && at >= 0 && at <= 1 ? mark : null),
      log || signed ? field("low end of the range", low, (value) => onrange(value, high)) : e("span", { class: "end" }, "0"),
      e("span", { class: "muted" }, signed ? `\u00B1 ${unit}` : unit,
        e("button", { class: "quiet", title: "the range of the errors", onclick: () => onrange(null, null) }, "auto"),
        limit === null ? null : e("button", { class: "quiet", title: "a thousandth of the limit to the limit", onclick: () => onrange(limit / 1000, limit) }, "to limit")),
      field("high end of the range", high, (value) => onrange(low, value)));
  };

  // What can be chosen about the images of a stage.
  function slider(title, { value, min, max, step, text }, oninput) {
    const output = e("output", {}, text(value));
    const input = e("input", { type: "range", min, max, step, "aria-label": title, oninput: () => {
      rayproof.replace(output, text(Number(input.value)));
      oninput(Number(input.value));
    } });
    input.value = value;
    return e("label", { class: "control" }, e("span", {}, title, " ", output), input);
  }

  function modes(current, usable, onpick) {
    return e("div", { class: "segments", role: "radiogroup", "aria-label": "view" }, rayproof.modes.map((mode, i) => {
      const off = !usable && mode !== "side";
      const pick = (step) => {
        const next = rayproof.modes[(i + step + rayproof.modes.length) % rayproof.modes.length];
        onpick(next);
        document.querySelector(`.segments [data-mode="${next}"]`)?.focus();
      };
      return e("button", { role: "radio", "data-mode": mode, "aria-checked": String(mode === current), disabled: off, tabindex: mode === current ? "0" : "-1",
        onclick: () => onpick(mode),
        onkeydown: (event) => {
          const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
          if (step && usable) { event.preventDefault(); pick(step); }
        } }, rayproof.modeTitle(mode));
    }));
  }

  const signed = (value) => (value > 0 ? `+${value}` : String(value));

  // set(parts): settings by the names of the address. choices: {ours, theirs, channels, stage, both, counts, noFlip}.
  rayproof.toolbar = function (settings, choices, set, viewer) {
    const pick = (title, pairs, current, key) => rayproof.select(title, pairs, current, (value) => set({ [key]: value }));
    const same = (names) => names.map((name) => [name, rayproof.reference(name)]);
    const check = (title, checked, act) => e("label", { class: "control check" }, e("input", { type: "checkbox", checked, onchange: (event) => act(event.target.checked) }), e("span", {}, title));
    const button = (text, title, act) => e("button", { class: "quiet", title, "aria-label": title, onclick: act }, text);
    const { ours, theirs, mine, other, channels, stage, both, counts, noFlip } = choices;
    return [
      e("div", { class: "controls" },
        ours.length ? pick("ours", ours.map((name) => [name, name]), mine, "ours") : null,
        theirs.length ? pick("reference", same(theirs), other, "reference") : null,
        pick("channel", channels, String(settings.channel), "channel"),
        modes(both ? settings.mode : "side", both, (mode) => set({ mode })),
        e("div", { class: "zoomers", role: "group", "aria-label": "zoom" }, button("\u2212", "zoom out", () => viewer.zoom(1 / 2)), button("+", "zoom in", () => viewer.zoom(2)),
          button("fit", "fit the image in", () => viewer.fit()), button("1.23", "1.23: zoom to where numbers are legible", () => viewer.legible())),
        button("?", "keyboard", rayproof.help)),
      e("div", { class: "controls" },
        rayproof.hasExposure(stage) ? [
          slider("exposure", { value: settings.exposure, min: -12, max: 12, step: 0.5, text: signed }, (value) => set({ exposure: value })),
          settings.map ? null : pick("tone", [["0", "sRGB"], ["1", "gamma 1"], ["1.8", "gamma 1.8"], ["2.2", "gamma 2.2"], ["3", "gamma 3"]], String(settings.gamma), "gamma"),
        ] : null,
        stage === "object" ? null : pick("colours", [["", "natural"], ...rayproof.colorMaps.map((name) => [name, `false: ${name}`])], settings.map, "map"),
        both ? [
          pick("error", rayproof.metrics.map((name) => [name, rayproof.metricTitle(name), name === "flip" ? noFlip : null]), settings.metric, "metric"),
          rayproof.isSigned(settings.metric) ? null : pick("error colours", same(rayproof.colorMaps), settings.colors, "colors"),
          check("log scale", settings.log, (on) => set({ scale: on ? "log" : "linear", low: "", high: "" })),
        ] : null,
        counts.length ? e("div", { class: "explained-control" }, check("explained pixels", settings.explained, (on) => set({ explained: on ? "1" : "" })),
          e("span", { class: "muted" }, counts.map(({ letter, name, count }) => e("span", { class: "kind", title: `${count} pixels over their limits, ${name}` },
            e("i", { class: `kind-${letter}`, "aria-hidden": "true" }, letter), ` ${name} ${count}`)))) : null),
    ];
  };
})(window.rayproof);
