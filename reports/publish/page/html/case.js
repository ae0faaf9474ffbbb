// One case: what it asks, stages as tabs, images, the pixel's story, checks, who agrees with whom, closed forms, 3-D.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  function header(row, data, around) {
    const step = (to, words, key) => (to ? e("a", { class: "chip", href: rayproof.link({ case: to.name, stage: to.stage }), title: `${to.name} (${key})` }, words) : null);
    return e("header", { class: "case-head" },
      e("p", { class: "trail" }, e("a", { href: rayproof.listAddress || "#" }, "\u2190 all cases"), " ",
        step(around.before, "\u2191 previous", "k"), step(around.after, "\u2193 next", "j")),
      e("h1", {}, rayproof.pill(row.verdict), " ", e("bdi", {}, row.name)),
      row.cause ? e("p", { class: "reason cause" }, e("strong", {}, rayproof.term("cause", "Cause"), ": "), e("bdi", {}, row.cause)) : null,
      row.excluded ? e("p", { class: "reason" }, e("strong", {}, "Excluded: "), e("bdi", {}, row.excluded)) : null,
      row.wrong ? e("p", { class: "reason" }, e("strong", {}, row.wrong), ".") : null,
      row.reason ? e("p", { class: "reason" }, row.blame ? e("strong", {}, `${row.blame}: `) : null, e("bdi", {}, rayproof.prose(row.reason))) : null,
      e("p", {}, rayproof.prose(row.stresses)),
      e("p", {}, (row.covers || []).map((id) => e("a", { class: "chip", href: rayproof.link({ id }) }, id)), " ",
        e("span", { class: "muted" }, [data.width && `${data.width} \u00D7 ${data.height} px`,
          data.lights !== undefined && `${data.lights} light${data.lights === 1 ? "" : "s"}`,
          [...new Set(data.shapes || [])].slice(0, 8).join(", "), rayproof.seconds(row.seconds)].filter(Boolean).join(" \u00B7 "))),
      rayproof.command(data.command));
  }

  function tabs(stages, data, current, onpick) {
    const verdictOf = (stage) => rayproof.worst((data.checks || []).filter((check) => check.stage === stage)
      .map((check) => check.verdict).filter((verdict) => verdict !== "unsupported")) || "unsupported";
    return e("div", { class: "tabs", role: "tablist", "aria-label": "Stages" }, stages.map((stage, i) => e("button", { role: "tab", id: `tab-${stage.name}`,
      "aria-selected": String(stage.name === current), "aria-controls": "stage-panel", tabindex: stage.name === current ? "0" : "-1",
      title: `${stage.meaning}${stage.unit ? ` [${stage.unit}]` : ""}`,
      onclick: () => onpick(stage.name),
      onkeydown: (event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (step) { event.preventDefault(); onpick(stages[(i + step + stages.length) % stages.length].name, true); }
      } },
    e("span", { class: `glyph ${rayproof.tone(verdictOf(stage.name))}`, "aria-hidden": "true" }, rayproof.glyph(verdictOf(stage.name))), " ", stage.name,
    e("span", { class: "offscreen" }, ` ${rayproof.word(verdictOf(stage.name))}`))));
  }

  const choose = (wanted, known, preferred) => (known.includes(wanted) ? wanted : preferred.find((name) => known.includes(name)) || known[0] || "");
  const next = (list, current, step) => list[(list.indexOf(current) + step + list.length) % list.length];

  rayproof.caseView = async function (results, row, around) {
    const data = await rayproof.load(row);
    const checks = data.checks || [];
    const stages = results.stages.filter((stage) => checks.some((check) => check.stage === stage.name)
      || data.renderers.some((renderer) => data.has(renderer, stage.name)));
    const earlier = results.comparison?.renderers || {};
    const { ours, theirs } = rayproof.sides(results, data);
    const panel = { tabs: e("div"), meaning: e("p", { class: "muted" }), decides: e("p", { class: "decides" }), checks: e("div"), panel: e("div") };
    let shown = null, turn = 0, later = 0;

    const set = (parts) => { rayproof.remember(parts); return show(); };
    const pointed = (x, y) => {
      inspector.show(x, y);
      scene?.pixel(x, y, shown.mine, shown.other);
      clearTimeout(later);
      // The address follows once the pointer rests, and never a case that was left meanwhile.
      later = setTimeout(() => root.isConnected && rayproof.remember({ at: `${x},${y}` }), 250);
    };
    const zoomed = ({ zoom }) => {
      clearTimeout(shown.zooming);
      shown.zooming = setTimeout(() => root.isConnected && rayproof.remember({ zoom: Number(zoom.toPrecision(3)) }), 250);
    };
    const view = rayproof.stageView(data, { ours, theirs, set, onpoint: pointed, onview: zoomed });
    const inspector = rayproof.inspector(data, stages);
    const go = (x, y) => { view.viewer.point(x, y); view.viewer.node.scrollIntoView({ block: "nearest" }); };
    const scene = rayproof.scene ? rayproof.scene(data, { stages, look: results.look, onpixel: go }) : null;

    async function show(focus) {
      const mine = (turn += 1);
      const wanted = rayproof.address(), settings = rayproof.settings();
      const stage = stages.find((item) => item.name === wanted.stage) || stages.find((item) => item.name === row.stage) || stages.at(-1);
      if (!stage) return;
      const bad = checks.find((check) => check.stage === stage.name && check.verdict === row.verdict && row.verdict !== "pass");
      const own = choose(wanted.ours, ours, [bad ? `tracer-${bad.configuration}` : "", bad ? bad.configuration : "", "tracer-float32"]);
      const other = choose(wanted.reference, theirs, [earlier[own], bad ? bad.reference : "", "analytic"]);
      const [a, b] = await Promise.all([data.image(own, stage.name), data.image(other, stage.name)]);
      if (mine !== turn) return;
      const first = shown === null;
      const elsewhere = first || shown.stage !== stage || shown.mine !== own || shown.other !== other;
      const check = checks.find((one) => one.stage === stage.name && one.configuration === rayproof.configurationOf(own) && one.reference === other);
      shown = { stage, mine: own, other, settings };
      rayproof.replace(panel.tabs, tabs(stages, data, stage.name, (name, held) => set({ stage: name, channel: "" , low: "", high: "" }).then(() => held && document.getElementById(`tab-${name}`)?.focus())));
      // On a narrow screen the tabs scroll; the chosen one is in sight.
      const tab = document.getElementById(`tab-${stage.name}`);
      if (tab) tab.parentNode.scrollLeft = tab.offsetLeft - (tab.parentNode.clientWidth - tab.offsetWidth) / 2;
      rayproof.replace(panel.meaning, stage.meaning, stage.unit && stage.unit !== "1" ? ` [${stage.unit}]` : "");
      rayproof.replace(panel.decides, rayproof.decides(check, stage, go));
      keepFocus(view.controls, () => view.draw(stage, own, other, a, b, settings));
      rayproof.replace(panel.checks, e("h3", {}, rayproof.term("check", "Checks")), rayproof.checkTable(checks.filter((check) => check.stage === stage.name), {
        configuration: rayproof.configurationOf(own), reference: other, unit: stage.unit === "1" ? "" : stage.unit, onpixel: go }));
      rayproof.replace(panel.panel, rayproof.adjudication((data.adjudication || {})[stage.name]));
      inspector.set({ ours: own, theirs: other, stage: stage.name, metric: settings.metric });
      if (elsewhere && (a || b)) {
        // The worst pixel of this check, unless another was chosen.
        const start = settings.pixel || rayproof.worstOf(check)?.pixel || rayproof.worstOf(bad)?.pixel;
        const image = a || b;
        if (start && start[0] < image.width && start[1] < image.height) {
          view.viewer.shared.pinned = Boolean(settings.pixel);
          view.viewer.mark(...start);
          inspector.show(...start);
          if (bad || settings.pixel) scene?.pixel(start[0], start[1], own, other);
        }
        if (first) requestAnimationFrame(() => view.viewer.restore(settings.zoom));
      }
      if (focus) document.getElementById(`tab-${stage.name}`)?.focus();
    }

    const move = (step) => set({ stage: next(stages, shown.stage, step).name, channel: "", low: "", high: "" });
    const cycle = (key, list, current) => set({ [key]: list[(list.indexOf(current) + 1) % list.length] });
    const open = (to) => to && (location.hash = rayproof.link({ case: to.name, stage: to.stage }));
    const rows = [
      [["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"], "on an image: another pixel, with shift by ten"],
      ["[", "previous stage", () => move(-1)], ["]", "next stage", () => move(1)],
      ["s", "side by side", () => set({ mode: "side" })], ["w", "swipe", () => set({ mode: "swipe" })],
      ["f", "flicker", () => set({ mode: "flicker" })], ["o", "onion skin", () => set({ mode: "onion" })], ["d", "error only", () => set({ mode: "error" })],
      [" ", "stop flickering, show the other image", () => view.viewer.toggle()],
      ["<", "less of ours, in swipe and onion skin", () => view.viewer.slide(-0.05)], [">", "more of ours", () => view.viewer.slide(0.05)],
      ["+", "zoom in", () => view.viewer.zoom(2)], ["-", "zoom out", () => view.viewer.zoom(0.5)],
      ["0", "fit the image in", () => view.viewer.fit()], ["n", "zoom to the numbers", () => view.viewer.legible()],
      ["e", "exposure up", () => set({ exposure: shown.settings.exposure + 0.5 })], ["E", "exposure down", () => set({ exposure: shown.settings.exposure - 0.5 })],
      ["g", "next tone curve", () => cycle("gamma", [0, 1, 1.8, 2.2, 3], shown.settings.gamma)],
      ["c", "next colours", () => cycle("map", ["", ...rayproof.colorMaps], shown.settings.map)],
      ["x", "next error metric", () => cycle("metric", rayproof.metrics, shown.settings.metric)],
      ["l", "logarithmic or linear scale of errors", () => set({ scale: shown.settings.log ? "linear" : "log", low: "", high: "" })],
      ["b", "pixels over their limits that rounding or a declared epsilon explains", () => set({ explained: shown.settings.explained ? "" : "1" })],
      ["v", "next channel", () => cycle("channel", [-1, ...(data.channels[shown.stage.name] || []).keys()], shown.settings.channel)],
      ["t", "next of ours", () => cycle("ours", ours, shown.mine)], ["r", "next reference", () => cycle("reference", theirs, shown.other)],
      ["y", "copy the command that reproduces this pixel", () => document.querySelector(".inspector .command button")?.click()],
      ["j", "next case", () => open(around.after)], ["k", "previous case", () => open(around.before)],
      ["Escape", "let the pixel follow the pointer again, then back to all cases", () => {
        if (!view.viewer.unpin()) location.hash = rayproof.listAddress || "";
      }],
    ];

    const root = e("main", { class: "case" }, rayproof.shoutBars(results), header(row, data, around), rayproof.preview(data),
      stages.length ? [panel.tabs,
        e("section", { class: "panel", role: "tabpanel", id: "stage-panel", "aria-label": "Stage" }, e("h2", { class: "offscreen" }, "Images and checks of this stage"), panel.meaning, panel.decides, view.controls, view.node, panel.checks, panel.panel),
        e("div", { class: "pair" }, e("div", {}, inspector.node), scene?.node)]
        : [e("p", { class: "panel muted" }, "Nothing was measured in this case."), scene?.node],
      rayproof.expectations(data.expectations || []), rayproof.unsupported(data.unsupported || []), rayproof.compared(results, data), rayproof.past(results, row.name), rayproof.small(data), rayproof.renders(data));
    if (!data.renderers.length) inspector.node.hidden = true;
    await show();
    return { node: root, keys: stages.length ? rows : rows.slice(-3), shown: () => shown && view.viewer.node.isConnected && show() };
  };

  // Rebuilding controls must not throw the keyboard user out of the one in use.
  function keepFocus(node, rebuild) {
    const held = document.activeElement;
    const name = node.contains(held) ? held.getAttribute("aria-label") || held.dataset.mode : null;
    const type = held?.type;
    rebuild();
    if (name) [...node.querySelectorAll("select, input, button")].find((one) => (one.getAttribute("aria-label") || one.dataset.mode) === name && one.type === type)?.focus();
  }
})(window.rayproof);
