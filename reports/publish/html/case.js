// One case: what it asks, stages as tabs, images, the pixel's story, checks, closed forms, picture.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const PREFIX = "tracer-";

  function header(row, data) {
    return e("header", { class: "case-head" },
      e("p", {}, e("a", { href: "#", onclick: back }, "\u2190 all cases")),
      e("h1", {}, rayproof.pill(row.verdict), " ", e("bdi", {}, row.name)),
      row.reason ? e("p", { class: "reason" }, row.blame ? e("strong", {}, `${row.blame}: `) : null, row.reason) : null,
      e("p", {}, row.stresses),
      e("p", {}, (row.covers || []).map((id) => e("a", { class: "chip", href: rayproof.link({ id }) }, id)), " ",
        e("span", { class: "muted" }, [data.width && `${data.width} \u00D7 ${data.height} px`,
          data.lights !== undefined && `${data.lights} light${data.lights === 1 ? "" : "s"}`,
          (data.shapes || []).join(", "), rayproof.seconds(row.seconds)].filter(Boolean).join(" \u00B7 "))),
      rayproof.command(row.reproduce || `rayproof run ${rayproof.quoted(row.name)}`));
  }

  // Back to the list as it was filtered.
  function back(event) {
    event.preventDefault();
    location.hash = rayproof.listAddress || "";
  }

  function tabs(stages, data, current, onpick) {
    const verdictOf = (stage) => rayproof.worst((data.checks || []).filter((check) => check.stage === stage)
      .map((check) => check.verdict).filter((verdict) => verdict !== "unsupported")) || "unsupported";
    const buttons = stages.map((stage, i) => e("button", { role: "tab", id: `tab-${stage.name}`, "aria-selected": String(stage.name === current),
      tabindex: stage.name === current ? "0" : "-1", title: `${stage.meaning}${stage.unit ? ` [${stage.unit}]` : ""}`,
      onclick: () => onpick(stage.name),
      onkeydown: (event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (step) onpick(stages[(i + step + stages.length) % stages.length].name, true);
      } },
      e("span", { class: `glyph ${rayproof.tone(verdictOf(stage.name))}` }, rayproof.glyph(verdictOf(stage.name))), " ", stage.name));
    return e("div", { class: "tabs", role: "tablist", "aria-label": "Stages" }, buttons);
  }

  function choose(wanted, known, preferred) {
    return known.includes(wanted) ? wanted : preferred.find((name) => known.includes(name)) || known[0] || "";
  }

  function slider(title, value, oninput) {
    const output = e("output", {}, value > 0 ? `+${value}` : value);
    const input = e("input", { type: "range", min: -12, max: 12, step: 0.5, value, "aria-label": title, oninput: () => {
      rayproof.replace(output, input.value > 0 ? `+${input.value}` : input.value);
      oninput(Number(input.value));
    } });
    input.value = value;
    return e("label", { class: "control" }, e("span", {}, title, " ", output), input);
  }

  rayproof.caseView = async function (results, row) {
    const data = await rayproof.load(row);
    const root = e("main", { class: "case" });
    const checks = data.checks || [];
    const stages = results.stages.filter((stage) => checks.some((check) => check.stage === stage.name)
      || data.renderers.some((renderer) => data.has(renderer, stage.name)));
    const ours = data.renderers.filter((name) => name.startsWith(PREFIX));
    const theirs = data.renderers.filter((name) => !name.startsWith(PREFIX));
    const view = { channel: -1, exposure: 0, gain: 0, metric: "absolute", pixel: null };
    const stagePanel = e("section", { class: "panel", role: "tabpanel", "aria-label": "Stage" });
    const pixelPanel = e("div");
    const tabBar = e("div");
    let choose3d = () => {};
    const scene = rayproof.scene(data, { onpixel: (x, y) => choose3d(x, y) });

    async function show() {
      const wanted = rayproof.address();
      const stage = stages.find((item) => item.name === wanted.stage) || stages.find((item) => item.name === row.stage) || stages.at(-1);
      if (!stage) return;
      const bad = checks.find((check) => check.stage === stage.name && check.verdict === row.verdict && row.verdict !== "pass");
      const mine = choose(wanted.ours, ours, [PREFIX + (bad ? bad.configuration : ""), "tracer-float32"]);
      const other = choose(wanted.reference, theirs, [bad ? bad.reference : "", "analytic"]);
      const configuration = mine.slice(PREFIX.length);
      const [a, b] = await Promise.all([data.image(mine, stage.name), data.image(other, stage.name)]);
      rayproof.replace(tabBar, tabs(stages, data, stage.name, (name, focus) => {
        rayproof.amend({ stage: name });
        view.channel = -1;
        show().then(() => focus && document.getElementById(`tab-${name}`)?.focus());
      }));
      const refused = (data.unsupported || []).find((item) => item.reference === other && item.stage === stage.name);
      const inspector = rayproof.inspector(data, stages, [[mine || "ours", mine], [other || "reference", other]], stage.name, view.metric);
      const pictures = e("div");
      let marked = null;
      const point = (x, y) => { view.pixel = [x, y]; inspector.show(x, y); scene?.pixel(x, y, mine, other); };
      const draw = () => {
        if (!a && !b) return rayproof.replace(pictures, e("p", { class: "muted" }, stage.name === "camera"
          ? "The camera stage is matrices, not an image; the checks below compare them." : "No image of this stage was kept."));
        marked = rayproof.figures({ stage: stage.name, unit: stage.unit === "1" ? "" : stage.unit, ours: a, theirs: b,
          names: { ours: mine, theirs: other }, view, metric: view.metric, onpixel: point,
          why: { ours: "No image of this stage was kept.", theirs: refused ? refused.why : "This reference did not answer this stage." } });
        return rayproof.replace(pictures, marked.node);
      };
      const go = (x, y) => { marked?.mark(x, y); pictures.scrollIntoView({ block: "nearest" }); };
      choose3d = go;
      const channels = [[-1, "all channels"], ...(data.channels[stage.name] || []).map((name, i) => [i, name])];
      const redraw = () => { draw(); if (view.pixel && marked) marked.mark(...view.pixel); };
      rayproof.replace(stagePanel,
        e("p", { class: "muted" }, stage.meaning, stage.unit && stage.unit !== "1" ? ` [${stage.unit}]` : ""),
        e("div", { class: "controls" },
          ours.length ? rayproof.select("ours", ours.map((name) => [name, name]), mine, (value) => { rayproof.amend({ ours: value }); show(); }) : null,
          theirs.length ? rayproof.select("reference", theirs.map((name) => [name, name]), other, (value) => { rayproof.amend({ reference: value }); show(); }) : null,
          a || b ? [
            rayproof.select("channel", channels, String(view.channel), (value) => { view.channel = Number(value); redraw(); }),
            rayproof.hasExposure(stage.name) ? slider("exposure", view.exposure, (value) => { view.exposure = value; redraw(); }) : null,
            rayproof.select("difference", rayproof.metrics.map((name) => [name, name]), view.metric, (value) => { view.metric = value; show(); }),
            slider("difference gain", view.gain, (value) => { view.gain = value; redraw(); }),
          ] : null),
        pictures,
        a || b ? e("p", { class: "muted legend" },
          swatch("nan"), "NaN ", swatch("inf"), "infinity ", swatch("miss"), "miss ", swatch("zero"), "no difference \u00B7 differences are of the stored float32 values; the checks were judged on what the renderers returned") : null,
        e("h3", {}, "Checks"),
        rayproof.checkTable(checks.filter((check) => check.stage === stage.name), { configuration, reference: other, unit: stage.unit === "1" ? "" : stage.unit, onpixel: go }));
      redraw();
      rayproof.replace(pixelPanel, a || b ? inspector.node : null);
      const start = view.pixel || bad?.end_to_end?.pixel;
      if (start && marked) marked.mark(...start);
    }

    const swatch = (name) => e("i", { class: `swatch ${name}` });
    rayproof.append(root, [rayproof.shoutBars(results), header(row, data),
      stages.length ? [tabBar, stagePanel, e("div", { class: "pair" }, pixelPanel, scene?.node)] : [e("p", { class: "panel muted" }, "Nothing was measured in this case."), scene?.node],
      rayproof.expectations(data.expectations || []), rayproof.unsupported(data.unsupported || []), rayproof.renders(data)]);
    await show();
    return root;
  };
})(window.rayproof);
