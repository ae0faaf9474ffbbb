// What can be chosen about the images of a stage.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

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
    const same = (names) => names.map((name) => [name, name]);
    const check = (title, checked, act) => e("label", { class: "control check" }, e("input", { type: "checkbox", checked, onchange: (event) => act(event.target.checked) }), e("span", {}, title));
    const button = (text, title, act) => e("button", { class: "quiet", title, "aria-label": title, onclick: act }, text);
    const { ours, theirs, mine, other, channels, stage, both, counts, noFlip } = choices;
    return [
      e("div", { class: "controls" },
        ours.length ? pick("ours", same(ours), mine, "ours") : null,
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
        counts.length ? e("div", { class: "edges-control" }, check("edges", settings.edges, (on) => set({ edges: on ? "1" : "" })),
          e("span", { class: "muted" }, counts.map(({ letter, name, count }) => e("span", { class: "kind", title: `${count} pixels near a ${name}: rounding may decide there` },
            e("i", { class: `kind-${letter}`, "aria-hidden": "true" }, letter), ` ${name} ${count}`)))) : null),
    ];
  };
})(window.rayproof);
