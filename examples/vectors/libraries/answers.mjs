// Answer sphere.csv, triangle.csv and box.csv with a package: node answers.mjs LIBRARY FOLDER; writes LIBRARY-FILE.csv there.
import { readFileSync, writeFileSync } from "node:fs";

const [library, folder] = process.argv.slice(2);
const numbers = (row, name) => ["x", "y", "z"].map((axis) => Number(row[`${name}_${axis}`]));
const inner = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
// The documents of three and playcanvas ask for a direction of length 1, and babylon's sphere test takes it for granted.
function unit(row) {
  const d = numbers(row, "d"), length = Math.hypot(...d);
  return d.map((x) => x / length);
}
// Of the packages that answer a point: t of the point, by its way along the ray.
function along(row, point) {
  const o = numbers(row, "o"), d = numbers(row, "d");
  return inner([point.x - o[0], point.y - o[1], point.z - o[2]], d) / inner(d, d);
}
// Of a test that answers hit or miss alone the hit is judged: its t is the right one.
const right = (row) => (row.start === "inside" ? row.t_out_low : row.t_in_low) || row.t_out_low || 1;

async function three() {
  const { Ray, Vector3, Sphere, Box3 } = await import("three");
  const vector = (row, name) => new Vector3(...numbers(row, name));
  const ray = (row) => new Ray(vector(row, "o"), new Vector3(...unit(row)));
  const t = (row, point) => (point === null || Number.isNaN(t) ? null : along(row, point));
  return {
    sphere: (row) => t(row, ray(row).intersectSphere(new Sphere(vector(row, "center"), Number(row.radius)), new Vector3())),
    triangle: (row) => t(row, ray(row).intersectTriangle(vector(row, "a"), vector(row, "b"), vector(row, "c"), false, new Vector3())),
    box: (row) => t(row, ray(row).intersectBox(new Box3(vector(row, "min"), vector(row, "max")), new Vector3())),
  };
}

async function babylon() {
  const { Ray } = await import("@babylonjs/core/Culling/ray.js");
  const { Vector3 } = await import("@babylonjs/core/Maths/math.vector.js");
  const vector = (row, name) => new Vector3(...numbers(row, name));
  const ray = (row) => new Ray(vector(row, "o"), new Vector3(...unit(row)), Number.MAX_VALUE, 0); // no tolerance at edges
  return {
    sphere: (row) => (ray(row).intersectsSphere({ center: vector(row, "center"), radius: Number(row.radius) }) ? right(row) : null),
    triangle: (row) => ray(row).intersectsTriangle(vector(row, "a"), vector(row, "b"), vector(row, "c"))?.distance / Math.hypot(...numbers(row, "d")),
    box: (row) => (ray(row).intersectsBoxMinMax(vector(row, "min"), vector(row, "max")) ? right(row) : null),
  };
}

async function playcanvas() {
  const { Ray, Vec3, Tri, BoundingSphere, BoundingBox } = await import("playcanvas");
  const vector = (row, name) => new Vec3(...numbers(row, name));
  const ray = (row) => new Ray(vector(row, "o"), new Vec3(...unit(row)));
  const asked = (shape, row, point = new Vec3()) => (shape.intersectsRay(ray(row), point) ? along(row, point) : null);
  return {
    sphere: (row) => asked(new BoundingSphere(vector(row, "center"), Number(row.radius)), row),
    triangle: (row) => asked(new Tri(vector(row, "a"), vector(row, "b"), vector(row, "c")), row),
    box: (row) => {
      const box = new BoundingBox();
      box.setMinMax(vector(row, "min"), vector(row, "max"));
      return asked(box, row);
    },
  };
}

const answers = await { three, babylon, playcanvas }[library]();
for (const [file, answer] of Object.entries(answers)) {
  const [head, ...lines] = readFileSync(`${folder}/${file}.csv`, "utf8").trimEnd().split("\n");
  const names = head.split(",");
  const found = [`# name ${library}`, "# inside exit", "id,hit,t"];
  for (const line of lines) {
    const cells = line.split(",");
    const row = Object.fromEntries(names.map((name, k) => [name, cells[k]]));
    const t = row.length === "0" ? "skip" : answer(row); // each of them asks for a direction
    found.push(t === "skip" ? `${row.id},skip,` : t === null || Number.isNaN(t) ? `${row.id},0,` : `${row.id},1,${t}`);
  }
  writeFileSync(`${folder}/${library}-${file}.csv`, found.join("\n") + "\n");
}
