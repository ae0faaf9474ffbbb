// Answer sphere.csv, triangle.csv and box.csv with a crate: answers LIBRARY FOLDER, which has the files; writes LIBRARY-FILE.csv.
use obvhs::{aabb::Aabb, ray::Ray as ObvhsRay, triangle::Triangle as ObvhsTriangle};
use parry3d::query::{Ray, RayCast};
use parry3d::shape::{Ball, Cuboid, Triangle};
use std::collections::HashMap;

type Row<'a> = HashMap<&'a str, &'a str>;

fn numbers(row: &Row, name: &str) -> [f32; 3] {
    ["x", "y", "z"].map(|axis| row[format!("{name}_{axis}").as_str()].parse().expect("a number"))
}

fn parry(file: &str, row: &Row) -> Option<f32> {
    let vector = |name: &str| parry3d::math::Vector::from_array(numbers(row, name));
    let far = f32::MAX;
    if file == "sphere" {
        let ray = Ray::new(vector("o") - vector("center"), vector("d"));
        return Ball::new(row["radius"].parse().expect("a radius")).cast_local_ray(&ray, far, false);
    }
    if file == "box" {
        let half = (vector("max") - vector("min")) * 0.5;
        let ray = Ray::new(vector("o") - (vector("max") + vector("min")) * 0.5, vector("d"));
        return Cuboid::new(half).cast_local_ray(&ray, far, false);
    }
    Triangle::new(vector("a"), vector("b"), vector("c")).cast_local_ray(&Ray::new(vector("o"), vector("d")), far, false)
}

// Its rays have length 1, so that its distances are divided by the length of the direction. It culls back faces: of a
// row that shows one, the corners are given in the other order.
fn bvh(file: &str, row: &Row) -> Option<f32> {
    let point = |name: &str| nalgebra::Point3::from(numbers(row, name));
    let direction = nalgebra::Vector3::from(numbers(row, "d"));
    let ray = bvh::ray::Ray::new(point("o"), direction);
    let t = if file == "box" {
        ray.intersection_slice_for_aabb(&bvh::aabb::Aabb::with_bounds(point("min"), point("max")))?.0
    } else if row["face"] == "back" {
        ray.intersects_triangle(&point("a"), &point("c"), &point("b")).distance
    } else {
        ray.intersects_triangle(&point("a"), &point("b"), &point("c")).distance
    };
    (t < f32::INFINITY).then(|| (f64::from(t) / direction.cast::<f64>().norm()) as f32)
}

fn obvhs(file: &str, row: &Row) -> Option<f32> {
    let vector = |name: &str| glam::Vec3A::from_array(numbers(row, name));
    let ray = ObvhsRay::new_inf(vector("o"), vector("d"));
    let t = if file == "box" {
        Aabb::new(vector("min"), vector("max")).intersect_ray(&ray)
    } else {
        ObvhsTriangle { v0: vector("a"), v1: vector("b"), v2: vector("c") }.intersect(&ray)
    };
    (t < f32::INFINITY).then_some(t)
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let (library, folder) = (words[1].as_str(), words[2].as_str());
    let (answer, inside, files): (fn(&str, &Row) -> Option<f32>, _, &[&str]) = match library {
        "parry3d" => (parry, "exit", &["sphere", "triangle", "box"]),
        "bvh" => (bvh, "zero", &["triangle", "box"]),
        _ => (obvhs, "near", &["triangle", "box"]),
    };
    for file in files {
        let text = std::fs::read_to_string(format!("{folder}/{file}.csv")).expect("a file of vectors");
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().expect("a first line").split(',').collect();
        let mut found = format!("# name {library}\n# inside {inside}\nid,hit,t\n");
        for line in lines {
            let row: Row = names.iter().copied().zip(line.split(',')).collect();
            found += &match (row["length"] == "0", answer(file, &row)) {
                (true, _) => format!("{},skip,\n", row["id"]), // each of them asks for a direction
                (_, Some(t)) => format!("{},1,{t}\n", row["id"]),
                (_, None) => format!("{},0,\n", row["id"]),
            };
        }
        std::fs::write(format!("{folder}/{library}-{file}.csv"), found).expect("a folder to write to");
    }
}
