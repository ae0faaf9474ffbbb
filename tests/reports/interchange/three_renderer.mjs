// Renders a glTF file by three.js: its reader, camera, lights, materials and rays; Lambertian shading by glTF's units.
// Usage: node three_renderer.mjs FOLDER_WITH_NODE_MODULES SCENE.gltf IMAGE.pfm WIDTH HEIGHT
import fs from "fs";
import path from "path";
import { pathToFileURL } from "url";

const [modules, scene_file, image_file, ...size] = process.argv.slice(2);
const [width, height] = size.map(Number);
const found = (name) => import(pathToFileURL(path.join(modules, "node_modules", "three", name)).href);
const THREE = await found("build/three.module.js");
const { GLTFLoader } = await found("examples/jsm/loaders/GLTFLoader.js");

const text = fs.readFileSync(scene_file, "utf8");
const document = JSON.parse(text);
for (const buffer of document.buffers ?? [])
  if (buffer.uri && !buffer.uri.startsWith("data:"))
    buffer.uri = "data:application/octet-stream;base64," +
      fs.readFileSync(path.join(path.dirname(scene_file), buffer.uri)).toString("base64");
// What a browser has and three.js asks for.
globalThis.self = globalThis;
globalThis.ProgressEvent = class {};
const gltf = await new GLTFLoader().parseAsync(JSON.stringify(document), "");
gltf.scene.updateMatrixWorld(true);
const [meshes, lights] = [[], []];
gltf.scene.traverse((node) => (node.isMesh ? meshes : node.isPointLight ? lights : []).push(node));
const camera = gltf.cameras[0];
const forward = camera.getWorldDirection(new THREE.Vector3());
const rays = new THREE.Raycaster();
const image = new Float32Array(3 * width * height);
for (let row = 0; row < height; row++)
  for (let column = 0; column < width; column++) {
    const place = new THREE.Vector2((2 * column + 1) / width - 1, 1 - (2 * row + 1) / height);
    rays.setFromCamera(place, camera);
    const speed = rays.ray.direction.dot(forward);
    [rays.near, rays.far] = [camera.near / speed, camera.far / speed];
    const hit = rays.intersectObjects(meshes, false)[0];
    if (!hit) continue;
    const normal = hit.face.normal.clone().transformDirection(hit.object.matrixWorld);
    if (normal.dot(rays.ray.direction) > 0) normal.negate();
    for (const light of lights) {
      const way = light.getWorldPosition(new THREE.Vector3()).sub(hit.point);
      const distance = way.length();
      const cosine = normal.dot(way) / distance;
      if (cosine <= 0) continue;
      const shadow = new THREE.Raycaster(hit.point, way.divideScalar(distance), 1e-5, distance * (1 - 1e-9));
      if (shadow.intersectObjects(meshes, false).length) continue;
      const { color } = hit.object.material;
      const arriving = (light.intensity * cosine) / distance ** 2 / Math.PI;
      const at = 3 * ((height - 1 - row) * width + column);
      image[at] += arriving * light.color.r * color.r;
      image[at + 1] += arriving * light.color.g * color.g;
      image[at + 2] += arriving * light.color.b * color.b;
    }
  }
fs.writeFileSync(image_file, Buffer.concat([Buffer.from(`PF\n${width} ${height}\n-1.0\n`), Buffer.from(image.buffer)]));
