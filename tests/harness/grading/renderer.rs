//! A student's ray tracer in Rust alone, with a switch for each of some mistakes; right without.
//!
//!     tracer [--mistake NAMES] [--only radiance] SCENE OUTPUT
//!
//! The names are those of examples/renderers/mistaken.cpp. It shares no code with the product.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::{env, fs, process};

const MISTAKES: [&str; 24] = [
    "left_handed", "whole_angle", "no_aspect", "pixel_corner", "transposed_matrix", "no_translation", "far_root",
    "diameter_for_radius", "cube_doubled", "square_disc", "triangle_culled", "first_hit", "clips_nothing",
    "normal_by_model", "normal_never_turned", "cube_normal_unsigned", "no_shadows", "no_four_pi", "linear_falloff",
    "no_cosine", "no_pi", "no_albedo", "back_seen", "bgr",
];

const XYZ: [&str; 3] = ["X", "Y", "Z"];
const RGB: [&str; 3] = ["R", "G", "B"];

type V = [f64; 3];

fn add(a: V, s: f64, b: V) -> V {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn scale(s: f64, a: V) -> V {
    add([0.0; 3], s, a)
}

fn unit(a: V) -> V {
    scale(1.0 / dot(a, a).sqrt(), a)
}

fn times(rows: &[V; 3], a: V) -> V {
    [dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)]
}

fn turned(m: &[V; 3]) -> [V; 3] {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}

/// A value of a JSON file.
enum Json {
    Number(f64),
    Text(String),
    Flag(bool),
    List(Vec<Json>),
    Table(BTreeMap<String, Json>),
    Nothing,
}

impl Json {
    fn at(&self, key: &str) -> &Json {
        match self {
            Json::Table(table) => table.get(key).unwrap_or(&Json::Nothing),
            _ => &Json::Nothing,
        }
    }

    fn number(&self, default: f64) -> f64 {
        if let Json::Number(value) = self { *value } else { default }
    }

    fn text(&self) -> &str {
        if let Json::Text(text) = self { text } else { "" }
    }

    fn list(&self) -> &[Json] {
        if let Json::List(list) = self { list } else { &[] }
    }

    fn vector(&self) -> V {
        let part = |k: usize| self.list().get(k).map_or(0.0, |value| value.number(0.0));
        [part(0), part(1), part(2)]
    }
}

struct Reader<'a> {
    text: &'a [u8],
    place: usize,
}

impl Reader<'_> {
    fn next(&mut self) -> u8 {
        while self.text[self.place].is_ascii_whitespace() {
            self.place += 1;
        }
        self.text[self.place]
    }

    fn take(&mut self) -> u8 {
        let found = self.next();
        self.place += 1;
        found
    }

    fn string(&mut self) -> String {
        self.take();
        let mut found = Vec::new();
        while self.text[self.place] != b'"' {
            self.place += (self.text[self.place] == b'\\') as usize;
            found.push(self.text[self.place]);
            self.place += 1;
        }
        self.place += 1;
        String::from_utf8(found).expect("text in UTF-8")
    }

    fn value(&mut self) -> Json {
        match self.next() {
            b'{' => {
                let mut table = BTreeMap::new();
                self.take();
                while self.next() != b'}' {
                    let key = self.string();
                    assert_eq!(self.take(), b':');
                    table.insert(key, self.value());
                    if self.next() == b',' {
                        self.take();
                    }
                }
                self.take();
                Json::Table(table)
            }
            b'[' => {
                let mut list = Vec::new();
                self.take();
                while self.next() != b']' {
                    list.push(self.value());
                    if self.next() == b',' {
                        self.take();
                    }
                }
                self.take();
                Json::List(list)
            }
            b'"' => Json::Text(self.string()),
            _ => {
                let start = self.place;
                while self.place < self.text.len() && !b",]} \n\r\t".contains(&self.text[self.place]) {
                    self.place += 1;
                }
                match std::str::from_utf8(&self.text[start..self.place]).expect("a word") {
                    "true" => Json::Flag(true),
                    "false" => Json::Flag(false),
                    "null" => Json::Nothing,
                    word => Json::Number(word.parse().expect("a number")),
                }
            }
        }
    }
}

type Mistakes = HashSet<String>;

/// A point that a ray meets: its distance, the face, and the normal in world space.
#[derive(Clone, Copy)]
struct Hit {
    distance: f64,
    face: usize,
    normal: V,
}

struct Shape {
    kind: String,
    albedo: V,
    two_sided: bool,
    rows: [V; 3],
    inverse: [V; 3],
    shift: V,
    center: V,
    radius: f64,
    faces: Vec<([V; 3], V)>,
}

impl Shape {
    fn new(given: &Json, folder: &Path, made: &Mistakes) -> Shape {
        let (mut rows, mut shift) = ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]);
        for (k, row) in given.at("to_world").list().iter().take(3).enumerate() {
            rows[k] = row.vector();
            shift[k] = row.list()[3].number(0.0);
        }
        if made.contains("transposed_matrix") {
            rows = turned(&rows);
        }
        if made.contains("no_translation") {
            shift = [0.0; 3];
        }
        let [a, b, c] = turned(&rows);
        let volume = dot(a, cross(b, c));
        let inverse = [cross(b, c), cross(c, a), cross(a, b)].map(|v| scale(1.0 / volume, v));
        let half = if made.contains("diameter_for_radius") { 0.5 } else { 1.0 };
        let mut shape = Shape {
            kind: given.at("type").text().to_string(),
            albedo: given.at("albedo").vector(),
            two_sided: matches!(given.at("two_sided"), Json::Flag(true)),
            rows,
            inverse,
            shift,
            center: given.at("center").vector(),
            radius: half * given.at("radius").number(1.0),
            faces: Vec::new(),
        };
        let mut vertices: Vec<V> = given.at("vertices").list().iter().map(Json::vector).collect();
        let mut faces = if vertices.is_empty() { Vec::new() } else { vec![[0, 1, 2]] };
        if shape.kind == "mesh" {
            let text = fs::read_to_string(folder.join(given.at("file").text())).expect("a mesh");
            for line in text.lines() {
                let words: Vec<&str> = line.split_whitespace().collect();
                let number = |k: usize| words[k].parse::<f64>().expect("a number");
                match words.first() {
                    Some(&"v") => vertices.push([number(1), number(2), number(3)]),
                    Some(&"f") => faces.push([1, 2, 3].map(|k| number(k) as usize - 1)),
                    _ => {}
                }
            }
        }
        for face in faces {
            let [p, q, r] = face.map(|k| vertices[k]);
            let corners = [p, q, r].map(|v| add(shape.shift, 1.0, times(&shape.rows, v)).map(|x| x as f32 as f64));
            let normal = shape.normal(cross(add(q, -1.0, p), add(r, -1.0, p)), made);
            shape.faces.push((corners, normal));
        }
        shape
    }

    fn normal(&self, n: V, made: &Mistakes) -> V {
        let by = if made.contains("normal_by_model") { self.rows } else { turned(&self.inverse) };
        unit(times(&by, n))
    }

    /// Return the nearest hit between two distances.
    fn hit(&self, origin: V, direction: V, low: f64, high: f64, made: &Mistakes) -> Option<Hit> {
        let within = |t: f64| low < t && t < high;
        if !self.faces.is_empty() {
            return self.triangle(origin, direction, low, high, made);
        }
        let o = times(&self.inverse, add(origin, -1.0, self.shift));
        let d = times(&self.inverse, direction);
        let found = |t: f64, n: V| Some(Hit { distance: t, face: 0, normal: self.normal(n, made) });
        if self.kind == "sphere" {
            let o = add(o, -1.0, self.center);
            let (square, half) = (dot(d, d), dot(o, d));
            let beside = add(o, -half / square, d);
            let left = square * (self.radius * self.radius - dot(beside, beside));
            if left < 0.0 {
                return None;
            }
            let mut roots = [(-half - left.sqrt()) / square, (-half + left.sqrt()) / square];
            if made.contains("far_root") {
                roots.reverse();
            }
            let t = roots.into_iter().find(|t| within(*t))?;
            found(t, add(o, t, d))
        } else if self.kind == "cube" {
            let half = if made.contains("cube_doubled") { 1.0 } else { 0.5 };
            let (mut enter, mut leave) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
            for k in 0..3 {
                if d[k] == 0.0 {
                    if o[k].abs() > half {
                        return None;
                    }
                    continue;
                }
                let (a, b) = ((-half - o[k]) / d[k], (half - o[k]) / d[k]);
                if a.min(b) > enter.0 {
                    enter = (a.min(b), k);
                }
                if a.max(b) < leave.0 {
                    leave = (a.max(b), k);
                }
            }
            if enter.0 > leave.0 {
                return None;
            }
            let (t, k) = [enter, leave].into_iter().find(|(t, _)| within(*t))?;
            let mut n = [0.0; 3];
            n[k] = if o[k] + t * d[k] > 0.0 || made.contains("cube_normal_unsigned") { 1.0 } else { -1.0 };
            found(t, n)
        } else {
            if d[2] == 0.0 {
                return None;
            }
            let t = -o[2] / d[2];
            let p = add(o, t, d);
            let disc = made.contains("square_disc") && p[0] * p[0] + p[1] * p[1] < 0.25;
            let square = !made.contains("square_disc") && p[0].abs() < 0.5 && p[1].abs() < 0.5;
            if within(t) && (self.kind == "plane" || disc || square) { found(t, [0.0, 0.0, 1.0]) } else { None }
        }
    }

    fn triangle(&self, origin: V, direction: V, low: f64, high: f64, made: &Mistakes) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        for (face, ([p, q, r], normal)) in self.faces.iter().enumerate() {
            let (e, f, s) = (add(*q, -1.0, *p), add(*r, -1.0, *p), add(origin, -1.0, *p));
            let h = cross(direction, f);
            let determinant = dot(e, h);
            if determinant == 0.0 || (made.contains("triangle_culled") && determinant < 0.0) {
                continue;
            }
            let (u, g) = (dot(s, h) / determinant, cross(s, e));
            let (v, t) = (dot(direction, g) / determinant, dot(f, g) / determinant);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && low < t && t < best.map_or(high, |one| one.distance) {
                best = Some(Hit { distance: t, face, normal: *normal });
            }
        }
        best
    }
}

fn nearest(shapes: &[Shape], o: V, d: V, low: f64, high: f64, made: &Mistakes) -> Option<(usize, Hit)> {
    let mut best: Option<(usize, Hit)> = None;
    for (index, shape) in shapes.iter().enumerate() {
        if let Some(hit) = shape.hit(o, d, low, high, made) {
            if best.map_or(true, |(_, other)| hit.distance < other.distance) {
                best = Some((index, hit));
            }
        }
        if best.is_some() && made.contains("first_hit") {
            break;
        }
    }
    best
}

/// Return the channels of each pixel in their order of rows, by their names.
fn render(scene: &Json, folder: &Path, made: &Mistakes) -> (usize, usize, BTreeMap<String, Vec<f32>>) {
    let camera = scene.at("camera");
    let shapes: Vec<Shape> = scene.at("shapes").list().iter().map(|one| Shape::new(one, folder, made)).collect();
    let lights: Vec<(V, V)> =
        scene.at("lights").list().iter().map(|one| (one.at("position").vector(), one.at("flux").vector())).collect();
    let (width, height) = (camera.at("width").number(0.0), camera.at("height").number(0.0));
    let eye = camera.at("eye").vector();
    let forward = unit(add(camera.at("target").vector(), -1.0, eye));
    let mut right = unit(cross(forward, camera.at("up").vector()));
    let up = cross(right, forward);
    if made.contains("left_handed") {
        right = scale(-1.0, right);
    }
    let angle = camera.at("fovy").number(0.0).to_radians();
    let tangent = (if made.contains("whole_angle") { angle } else { angle / 2.0 }).tan();
    let aspect = if made.contains("no_aspect") { 1.0 } else { width / height };
    let middle = if made.contains("pixel_corner") { 0.0 } else { 0.5 };
    let clip = if made.contains("clips_nothing") { "none" } else { scene.at("clip").text() };
    let simplified = scene.at("shading").text() == "simplified";
    let mut channels: BTreeMap<String, Vec<f32>> = BTreeMap::new();
    for k in 0..(width * height) as usize {
        let (x, y) = ((k % width as usize) as f64 + middle, (k / width as usize) as f64 + middle);
        let across = (2.0 * x / width - 1.0) * aspect * tangent;
        let d = unit(add(add(forward, across, right), (1.0 - 2.0 * y / height) * tangent, up));
        let deep = if clip == "depth" { dot(d, forward) } else { 1.0 };
        let near = if clip == "none" { 0.0 } else { camera.at("near").number(0.0) / deep };
        let far = if clip == "none" { f64::INFINITY } else { camera.at("far").number(0.0) / deep };
        let met = nearest(&shapes, eye, d, near, far, made);
        let shape = met.map(|(index, _)| &shapes[index]);
        let p = met.map_or([0.0; 3], |(_, hit)| add(eye, hit.distance, d));
        let mut n = met.map_or([0.0; 3], |(_, hit)| hit.normal);
        let behind = dot(n, d) > 0.0;
        let two_sided = shape.map_or(false, |one| one.two_sided);
        if behind && two_sided && !made.contains("normal_never_turned") {
            n = scale(-1.0, n);
        }
        let mut put = |name: &str, parts: &[&str], values: &[f64]| {
            for (part, value) in parts.iter().zip(values) {
                channels.entry(format!("{name}{part}")).or_default().push(*value as f32);
            }
        };
        put("ray.", &XYZ, &d);
        put("position.", &XYZ, &p);
        put("normal.", &XYZ, &n);
        put("object.", &["V"], &[met.map_or(-1.0, |(index, _)| index as f64)]);
        put("face.", &["V"], &[met.map_or(-1.0, |(_, hit)| hit.face as f64)]);
        put("distance.", &["V"], &[met.map_or(f64::INFINITY, |(_, hit)| hit.distance)]);
        let size = dot(p, p).max(dot(eye, eye)).sqrt().max(1.0);
        let start = add(p, 1e-12 * size, n);
        let mut irradiance = [0.0; 3];
        for (index, (position, flux)) in lights.iter().enumerate() {
            let to = add(*position, -1.0, p);
            let r = dot(to, to).sqrt();
            let cosine = if shape.is_some() && r > 0.0 { dot(n, to) / r } else { 0.0 };
            let free = || nearest(&shapes, start, add(*position, -1.0, start), 0.0, 1.0, made).is_none();
            let lit = cosine > 0.0 && (made.contains("no_shadows") || free());
            put("visibility.", &[&index.to_string()], &[lit as u8 as f64]);
            let mut weight = if made.contains("no_cosine") { 1.0 } else { cosine };
            if !simplified {
                weight /= if made.contains("linear_falloff") { r } else { r * r };
                weight /= if made.contains("no_four_pi") { 1.0 } else { 4.0 * std::f64::consts::PI };
            }
            if lit {
                irradiance = add(irradiance, weight, *flux);
            }
        }
        let albedo = shape.map_or([0.0; 3], |one| if made.contains("no_albedo") { [1.0; 3] } else { one.albedo });
        let exitance = [0, 1, 2].map(|c| albedo[c] * irradiance[c]);
        let pi = if simplified || made.contains("no_pi") { 1.0 } else { std::f64::consts::PI };
        let dark = behind && !two_sided && !made.contains("back_seen");
        let mut radiance = if dark { [0.0; 3] } else { scale(1.0 / pi, exitance) };
        if made.contains("bgr") {
            radiance.reverse();
        }
        if !lights.is_empty() {
            put("irradiance.", &RGB, &irradiance);
            put("exitance.", &RGB, &exitance);
            put("", &RGB, &radiance);
        }
    }
    (width as usize, height as usize, channels)
}

fn write_exr(path: &str, width: usize, height: usize, channels: &BTreeMap<String, Vec<f32>>) {
    let ints = |values: &[i32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let listed = channels.keys().flat_map(|name| [name.as_bytes(), b"\0", &ints(&[2, 0, 1, 1])].concat());
    let window = ints(&[0, 0, width as i32 - 1, height as i32 - 1]);
    let mut file = ints(&[20000630, 2]);
    for (name, kind, value) in [
        ("channels", "chlist", listed.chain([0]).collect::<Vec<u8>>()),
        ("compression", "compression", vec![0]),
        ("dataWindow", "box2i", window.clone()),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", vec![0]),
        ("pixelAspectRatio", "float", 1f32.to_le_bytes().to_vec()),
        ("screenWindowCenter", "v2f", vec![0; 8]),
        ("screenWindowWidth", "float", 1f32.to_le_bytes().to_vec()),
    ] {
        file.extend(format!("{name}\0{kind}\0").bytes());
        file.extend(ints(&[value.len() as i32]));
        file.extend(value);
    }
    file.push(0);
    let (line, first) = (4 * width * channels.len(), file.len() + 8 * height);
    for y in 0..height {
        file.extend(((first + y * (8 + line)) as u64).to_le_bytes());
    }
    for y in 0..height {
        file.extend(ints(&[y as i32, line as i32]));
        for values in channels.values() {
            file.extend(values[y * width..(y + 1) * width].iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    fs::write(path, file).expect("the image is written");
}

fn main() {
    let words: Vec<String> = env::args().skip(1).collect();
    if words.iter().any(|word| word == "--mistakes") {
        println!("{}", MISTAKES.join("\n"));
        return;
    }
    if words.last().map_or(false, |word| word == "--capabilities") {
        println!(
            r#"{{"protocol": 1, "name": "student", "precision": "float64", "chained": true, "epsilons": {{"shadow": 1e-7}}}}"#
        );
        return;
    }
    let value = |name: &str| words.iter().position(|word| word == name).map_or("", |k| words[k + 1].as_str());
    let made: Mistakes = value("--mistake").split(',').filter(|name| !name.is_empty()).map(String::from).collect();
    if let Some(name) = made.iter().find(|name| !MISTAKES.contains(&name.as_str())) {
        eprintln!("unknown: {name}");
        process::exit(1);
    }
    if words.len() < 2 {
        process::exit(1);
    }
    let (path, output) = (&words[words.len() - 2], &words[words.len() - 1]);
    let text = fs::read(path).expect("a scene");
    let scene = Reader { text: &text, place: 0 }.value();
    let (width, height, mut channels) = render(&scene, Path::new(path).parent().expect("a folder"), &made);
    if value("--only") == "radiance" {
        channels.retain(|name, _| RGB.contains(&&name[..]));
    }
    if channels.is_empty() {
        println!("It writes radiance alone, and there is no light.");
        process::exit(77);
    }
    write_exr(output, width, height, &channels);
}
