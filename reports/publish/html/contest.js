// Two formulas on the same rays: digits gained and time ratio of every family, with their intervals.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const { svg } = rayproof;
  const WIDTH = 180, HEIGHT = 18;
  const TONES = { better: "pass", worse: "fail", "a trade": "warn" };
  const tone = (outcome) => TONES[outcome] || "unsupported";
  const th = (title) => e("th", { scope: "col" }, title);
  const numbers = (pair) => (pair || []).map((one) => rayproof.number(one)).filter((one) => Number.isFinite(one));

  // An interval on an axis that all rows share; `nothing` is where both are alike.
  function bar([low, high], nothing, value, pair, words) {
    const x = (one) => 4 + ((one - low) / (high - low || 1)) * (WIDTH - 8);
    const ends = numbers(pair);
    if (!Number.isFinite(value) || ends.length !== 2) return e("span", { class: "muted" }, "\u2013");
    return e("span", { class: "interval" }, svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, width: WIDTH, height: HEIGHT, "aria-hidden": "true" },
      svg("path", { class: "nothing", d: `M${x(nothing)} 0V${HEIGHT}` }), svg("path", { class: "reach", d: `M${x(ends[0])} ${HEIGHT / 2}H${x(ends[1])}` }),
      svg("circle", { cx: x(value), cy: HEIGHT / 2, r: 3.5 })), words);
  }

  const span = (values, nothing) => [Math.min(nothing, ...values), Math.max(nothing, ...values)];

  function view(results) {
    const { contest } = results;
    const digits = span(contest.families.flatMap((one) => numbers(one.digits_interval)), 0);
    const times = span(contest.families.flatMap((one) => numbers(one.time_interval)).map(Math.log), 0);
    const known = new Set(results.cases.map((row) => row.family));
    const line = (one) => {
      const [gained, ratio] = [rayproof.number(one.digits_gained), rayproof.number(one.time_ratio)];
      const told = (pair, places) => numbers(pair).map((value) => value.toFixed(places)).join(", ");
      const wrong = one.wrong.length ? `${one.wrong[0]} \u2192 ${one.wrong[1]} of ${one.pixels}` : "";
      return e("tr", {}, e("td", {}, e("span", { class: `glyph mark ${rayproof.tone(tone(one.outcome))}`, "aria-hidden": "true" }, rayproof.glyph(tone(one.outcome))), " ", one.outcome),
        e("th", { scope: "row" }, known.has(one.family) ? e("a", { href: rayproof.link({ family: one.family }) }, one.family) : one.family, one.stress ? e("span", { class: "muted" }, " stress") : null),
        e("td", { class: "figure" }, bar(digits, 0, gained, one.digits_interval, gained === null ? "" : `${gained > 0 ? "+" : ""}${gained.toFixed(2)} [${told(one.digits_interval, 2)}]`)),
        e("td", { class: "figure" }, wrong),
        e("td", { class: "figure" }, bar(times, 0, ratio > 0 ? Math.log(ratio) : NaN, numbers(one.time_interval).map(Math.log), ratio === null ? "" : `\u00D7${ratio.toFixed(3)} [${told(one.time_interval, 3)}]`)),
        e("td", { class: "figure" }, (one.nanoseconds_per_ray || []).map((value) => rayproof.short(value)).join(" \u2192 ")));
    };
    return e("div", {}, e("section", { class: `verdict ${rayproof.tone(tone(contest.outcome))}` }, e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(tone(contest.outcome))),
      e("div", {}, e("h1", {}, `${contest.base} \u2192 ${contest.candidate}: ${contest.outcome}`), e("p", {}, contest.verdict),
        e("p", { class: "muted" }, `control, ${contest.base} against itself: ${contest.control}`))),
    e("section", { class: "panel contest", "aria-label": "Families" }, e("div", { class: "scroll" }, e("table", {},
      e("thead", {}, e("tr", {}, ["", "family", "digits gained, more is better", "decided wrongly", "time ratio, less is better", "ns per ray"].map(th))),
      e("tbody", {}, contest.families.map(line)))),
    e("p", { class: "muted legend" }, "Intervals of all families hold together at 95 %; the upright line is where both are alike."),
    rayproof.command(`rayproof compare ${rayproof.quoted(String(contest.base))} ${rayproof.quoted(String(contest.candidate))}`)));
  }

  rayproof.addPage("contest", { title: "Comparison", has: (results) => Boolean(results.contest), view });
})(window.rayproof);
