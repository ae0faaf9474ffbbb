// Answer sphere.csv with a sphere formula in JavaScript: node sphere.mjs sphere.csv > answers.csv
import { readFileSync } from "node:fs";

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// The smallest t > 0, or Infinity. Haines, Guenther, Akenine-Moeller, Ray Tracing Gems (2019), chapter 7.
function sphere(o, d, center, radius) {
  const f = o.map((x, k) => x - center[k]);
  const a = dot(d, d), b = -dot(f, d);
  if (a === 0) return Infinity;
  const closest = f.map((x, k) => x + (b / a) * d[k]);
  const discriminant = radius * radius - dot(closest, closest);
  if (discriminant < 0) return Infinity;
  const root = Math.sqrt(a * discriminant);
  const q = b < 0 ? b - root : b + root;
  const ends = [q ? (dot(f, f) - radius * radius) / q : 0, q / a].sort((x, y) => x - y);
  return ends.find((t) => t > 0) ?? Infinity;
}

const [head, ...lines] = readFileSync(process.argv[2], "utf8").trimEnd().split("\n");
const names = head.split(",");
const answers = ["# name sphere.mjs", "id,hit,t"];
for (const line of lines) {
  // Only the last column, a sentence, may hold commas.
  const cells = line.split(",");
  const row = Object.fromEntries(names.map((name, k) => [name, cells[k]]));
  const vector = (name) => ["x", "y", "z"].map((axis) => Number(row[`${name}_${axis}`]));
  const t = sphere(vector("o"), vector("d"), vector("center"), Number(row.radius));
  answers.push(t < Infinity ? `${row.id},1,${t}` : `${row.id},0,`);
}
console.log(answers.join("\n"));
