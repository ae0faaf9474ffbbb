// Answer sphere.csv with a float32 sphere formula in Rust: rustc -O sphere.rs && ./sphere sphere.csv > answers.csv
use std::collections::HashMap;

type Vector = [f32; 3];

fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

// The smallest t > 0, or infinity. Haines, Guenther, Akenine-Moeller, Ray Tracing Gems (2019), chapter 7.
fn sphere(o: Vector, d: Vector, center: Vector, radius: f32) -> f32 {
    let f = [o[0] - center[0], o[1] - center[1], o[2] - center[2]];
    let (a, b) = (dot(d, d), -dot(f, d));
    if a == 0.0 {
        return f32::INFINITY;
    }
    let s = b / a;
    let closest = [f[0] + s * d[0], f[1] + s * d[1], f[2] + s * d[2]];
    let discriminant = radius * radius - dot(closest, closest);
    if discriminant < 0.0 {
        return f32::INFINITY;
    }
    let q = b + (a * discriminant).sqrt().copysign(b);
    let other = if q != 0.0 { (dot(f, f) - radius * radius) / q } else { 0.0 };
    let (near, far) = if other < q / a { (other, q / a) } else { (q / a, other) };
    if near > 0.0 {
        near
    } else if far > 0.0 {
        far
    } else {
        f32::INFINITY
    }
}

fn main() {
    let path = std::env::args().nth(1).expect("sphere.csv");
    let text = std::fs::read_to_string(path).expect("a readable file");
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("a first line").split(',').collect();
    println!("# name sphere.rs\nid,hit,t");
    for line in lines {
        let row: HashMap<&str, &str> = names.iter().copied().zip(line.split(',')).collect();
        let number = |name: String| row[name.as_str()].parse::<f32>().expect("a number");
        let vector = |name: &str| ["x", "y", "z"].map(|axis| number(format!("{name}_{axis}")));
        let t = sphere(vector("o"), vector("d"), vector("center"), number("radius".to_string()));
        println!("{},{},{}", row["id"], i32::from(t < f32::INFINITY), t);
    }
}
