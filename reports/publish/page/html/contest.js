// Two formulas on the same rays: digits gained and time ratio of every family, with their intervals.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const TONES = { better: "pass", worse: "fail", "a trade": "warn" };
  const tone = (outcome) => TONES[outcome] || "unsupported";
  const th = (title) => e("th", { scope: "col" }, title);
  function view(results) {
    const { contest } = results;
    const digits = rayproof.intervals(contest.families.map((one) => one.digits_interval), 0);
    const times = rayproof.intervals(contest.families.map((one) => one.time_interval), 1, { log: true });
    const known = new Set(results.cases.map((row) => row.family));
    const line = (one) => {
      const [gained, ratio] = [rayproof.number(one.digits_gained), rayproof.number(one.time_ratio)];
      const wrong = one.wrong.length ? `${one.wrong[0]} \u2192 ${one.wrong[1]} of ${one.pixels}` : "";
      return e("tr", {}, e("td", {}, e("span", { class: `glyph mark ${rayproof.tone(tone(one.outcome))}`, "aria-hidden": "true" }, rayproof.glyph(tone(one.outcome))), " ", one.outcome),
        e("th", { scope: "row" }, known.has(one.family) ? e("a", { href: rayproof.link({ family: one.family }) }, one.family) : one.family, one.stress ? e("span", { class: "muted" }, " stress") : null),
        e("td", { class: "figure" }, digits(gained, one.digits_interval, gained === null ? "" : `${gained > 0 ? "+" : ""}${gained.toFixed(2)} ${rayproof.between(one.digits_interval, 2)}`)),
        e("td", { class: "figure" }, wrong),
        e("td", { class: "figure" }, times(ratio, one.time_interval, ratio === null ? "" : `\u00D7${ratio.toFixed(3)} ${rayproof.between(one.time_interval, 3)}`)),
        e("td", { class: "figure" }, (one.nanoseconds_per_ray || []).map((value) => rayproof.short(value)).join(" \u2192 ")));
    };
    return e("div", {}, e("section", { class: `verdict ${rayproof.tone(tone(contest.outcome))}` }, e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(tone(contest.outcome))),
      e("div", {}, e("h1", {}, `${contest.base} \u2192 ${contest.candidate}: ${contest.outcome}`), e("p", {}, contest.verdict),
        e("p", { class: "muted" }, `control, ${contest.base} against itself: ${contest.control}`))),
    e("section", { class: "panel contest", "aria-label": "Families" }, rayproof.scroll("table of families", e("table", {},
      e("thead", {}, e("tr", {}, ["", "family", "digits gained, more is better", "decided wrongly", "time ratio, less is better", "ns per ray"].map(th))),
      e("tbody", {}, contest.families.map(line)))),
    e("p", { class: "muted legend" }, "Intervals of all families hold together at 95 %; the upright line is where both are alike."),
    rayproof.command(`rayproof compare ${rayproof.quoted(String(contest.base))} ${rayproof.quoted(String(contest.candidate))}`)));
  }

  rayproof.addPage("contest", { title: "Comparison", has: (results) => Boolean(results.contest), view });
})(window.rayproof);
