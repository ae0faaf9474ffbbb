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
    const panes = { reference: rayproof.pane("image of the reference"), ours: rayproof.pane("image of ours"), both: rayproof.pane("both images"), error: rayproof.pane("image of the errors") };
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
      const kinds = rayproof.kindsAt(shown.mask, shown.bitmaps.edges.width, x, y).map(({ letter }) => letter).join(" ");
      return kinds ? [kinds] : [];
    };

    function paint() {
      if (!shown || !node.isConnected) return;
      const { bitmaps, ours, theirs, errors, settings } = shown;
      const base = { image: shared.image, view: shared.view, pixel: shared.pixel };
      const over = bitmaps.edges && settings.edges ? [{ bitmap: bitmaps.edges }] : [];
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
      panes.reference.caption("reference", what.notes.theirs);
      panes.ours.caption("ours", what.notes.ours);
      panes.error.caption(`${rayproof.metricTitle(what.settings.metric)} error`, what.notes.error);
      panes.both.caption(TITLES[mode], `${what.names.ours} over ${what.names.theirs}`);
      const ends = mode === "swipe" ? ["ours", "reference"] : ["reference", "ours"];
      rayproof.replace(panes.both.foot, mode === "flicker" ? play : e("label", { class: "share" }, e("span", {}, ends[0]), share, e("span", {}, ends[1])));
      rayproof.replace(panes.error.foot, what.foot);
      const pair = what.ours && what.theirs && what.errors;
      const error = what.errors ? panes.error.node : absent("error", what.why.error);
      const parts = mode === "error" && what.errors ? [error]
        : mode !== "side" && pair ? [panes.both.node, error]
        : [what.theirs ? panes.reference.node : absent("reference", what.why.theirs),
          what.ours ? panes.ours.node : absent("ours", what.why.ours), error];
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
})(window.rayproof);
