// The inverse of reports/results/compact.py: what the checks of a case have in common goes back into each of them.
(function (rayproof) {
  "use strict";

  const COUNTS = ["over_inside", "edge", "differ_at_edge", "wrong_at_edge", "in_window", "differ_in_window", "hit_miss", "nan", "inf", "flagged"];
  const NUMBERS = ["worst_ratio", "worst_error", "limit", "ulp"];
  const KINDS = ["wide", "side", "interval", "epsilon", "wrong", "unexamined"];

  const zeros = (names) => Object.fromEntries(names.map((name) => [name, 0]));
  const completed = (measured, pixels) => (measured ? { interior: pixels - (measured.edge || 0), worst_inside: measured.worst_ratio || 0, ...zeros(COUNTS), ...zeros(NUMBERS), pixel: [0, 0], ...measured } : null);
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
  const ungrouped = (groups, because, pixels) => groups.flatMap((group) => !group || !group.stages ? [group]
    : Object.entries(group.stages).map(([stage, check]) => ({
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
})(window.rayproof);
