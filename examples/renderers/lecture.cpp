// A ray tracer in the lecture's style, in double precision: spheres, cubes, squares, planes, triangles and meshes.
//
//     c++ -O2 -std=c++17 -o lecture lecture.cpp
//     rayproof run --subject "exec:./lecture {scene} {output}"
//
// Its stages are made of one another and written as floats, which it says by "chained": a stage is then judged on its own.
// Compiled with -DPLANTED_BUG it turns normals by the model matrix instead of its inverse transpose, and with
// -DWORLD_NORMALS=true it takes the normals of faces from their rounded corners in the world, which it declares.
#include <algorithm>
#include <array>
#include <iostream>
#include <limits>

#include "rayproof.hpp"

#ifndef WORLD_NORMALS
#define WORLD_NORMALS false
#endif

using Json = rayproof::Json;
constexpr double PI = 3.14159265358979323846, INF = std::numeric_limits<double>::infinity();

struct Vec {
    double x = 0, y = 0, z = 0;
    double& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
    double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double length(Vec a) { return std::sqrt(dot(a, a)); }
Vec normalize(Vec a) { return (1 / length(a)) * a; }
Vec vec(const Json& j) { return {j[0].number, j[1].number, j[2].number}; }

// The 3x3 part of a model matrix by its columns, and its translation.
struct Placement {
    Vec a{1, 0, 0}, b{0, 1, 0}, c{0, 0, 1}, t{};
    Vec turn(Vec v) const { return v.x * a + v.y * b + v.z * c; }
    Vec point(Vec v) const { return turn(v) + t; }
    double determinant() const { return dot(a, cross(b, c)); }
    Vec back(Vec v) const {
        return (1 / determinant()) * Vec{dot(v, cross(b, c)), dot(v, cross(c, a)), dot(v, cross(a, b))};
    }
    Vec normal(Vec n) const {  // by the inverse transpose: its columns are the cofactors over the determinant
#ifdef PLANTED_BUG
        return normalize(turn(n));
#else
        return normalize((1 / determinant()) * (n.x * cross(b, c) + n.y * cross(c, a) + n.z * cross(a, b)));
#endif
    }
};

struct Ray { Vec origin, direction; double low, high; };
struct Hit { double t = INF; int shape = -1, face = 0; Vec normal; };

struct Shape {
    std::string type;
    Vec albedo, center;
    double radius = 1;
    bool two_sided = false;
    Placement place;
    std::vector<std::array<Vec, 3>> faces;  // of triangles and meshes, as float32 numbers in the world
    std::vector<Vec> normals;               // of these faces

    // Report t of a hit inside the ray's interval, with the normal in object space.
    template <class Found> void meet(const Ray& ray, Found found) const {
        if (!faces.empty()) return triangles(ray, found);
        const Vec o = place.back(ray.origin - place.t), d = place.back(ray.direction);  // not normalized: t stays t
        auto inside = [&](double t) { return t > ray.low && t < ray.high; };
        if (type == "sphere") {
            const Vec from = o - center;
            const double A = dot(d, d), B = dot(from, d);
            const Vec off = from - (B / A) * d;  // the discriminant without b^2 - 4ac's cancellation
            const double D = A * (radius * radius - dot(off, off));
            if (D < 0) return;
            for (double t : {(-B - std::sqrt(D)) / A, (-B + std::sqrt(D)) / A})
                if (inside(t)) return found(t, 0, place.normal((1 / radius) * (from + t * d)));
        } else if (type == "cube") {
            double low = -INF, high = INF;
            int first = 0, last = 0;
            for (int k = 0; k < 3; ++k) {
                if (d[k] == 0 && std::abs(o[k]) > 0.5) return;
                if (d[k] == 0) continue;
                double t0 = (-0.5 - o[k]) / d[k], t1 = (0.5 - o[k]) / d[k];
                if (t0 > t1) std::swap(t0, t1);
                if (t0 > low) low = t0, first = k;
                if (t1 < high) high = t1, last = k;
            }
            if (low > high) return;
            for (auto [t, axis] : {std::pair(low, first), std::pair(high, last)})
                if (inside(t)) {
                    Vec n;
                    n[axis] = o[axis] + t * d[axis] > 0 ? 1 : -1;
                    return found(t, 0, place.normal(n));
                }
        } else if (d.z != 0) {  // square or plane, in z = 0
            const double t = -o.z / d.z;
            const Vec p = o + t * d;
            if (inside(t) && (type == "plane" || (std::abs(p.x) < 0.5 && std::abs(p.y) < 0.5)))
                found(t, 0, place.normal({0, 0, 1}));
        }
    }

    // Woop, Benthin and Wald (2013): the corners are sheared so that the ray becomes the z axis. A corner is sheared alike
    // for all triangles that share it, and an edge has one area with two signs: no ray slips between two of them, unless a
    // compiler fuses product and difference (-ffp-contract=off).
    template <class Found> void triangles(const Ray& ray, Found found) const {
        const double x = std::abs(ray.direction.x), y = std::abs(ray.direction.y), z = std::abs(ray.direction.z);
        auto turned = [&](Vec v) { return x >= y && x >= z ? Vec{v.y, v.z, v.x} : y >= z ? Vec{v.z, v.x, v.y} : v; };
        const Vec d = turned(ray.direction);
        auto sheared = [&](Vec p) {
            const Vec v = turned(p - ray.origin);
            return Vec{v.x - d.x / d.z * v.z, v.y - d.y / d.z * v.z, v.z / d.z};
        };
        for (std::size_t i = 0; i < faces.size(); ++i) {
            const auto& [p, q, r] = faces[i];
            const Vec A = sheared(p), B = sheared(q), C = sheared(r);
            const double u = C.x * B.y - C.y * B.x, v = A.x * C.y - A.y * C.x, w = B.x * A.y - B.y * A.x, det = u + v + w;
            if (det == 0 || ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0))) continue;
            const double t = (u * A.z + v * B.z + w * C.z) / det;
            if (t > ray.low && t < ray.high) found(t, int(i), normals[i]);
        }
    }
};

struct Light { Vec position, flux; };

struct Scene {
    std::vector<Shape> shapes;
    std::vector<Light> lights;
    bool simplified;

    Hit nearest(const Ray& ray) const {
        Hit best;
        for (std::size_t i = 0; i < shapes.size(); ++i)
            shapes[i].meet(ray, [&](double t, int face, Vec n) { if (t < best.t) best = {t, int(i), face, n}; });
        return best;
    }
};

Shape read_shape(const Json& j, const std::string& path) {
    Shape s;
    s.type = j["type"].text, s.albedo = vec(j["albedo"]), s.two_sided = j.has("two_sided") && j["two_sided"].flag;
    if (j.has("center")) s.center = vec(j["center"]);
    if (j.has("radius")) s.radius = j["radius"].number;
    if (j.has("to_world")) {
        const Json& rows = j["to_world"];
        auto column = [&](int k) { return Vec{rows[0][k].number, rows[1][k].number, rows[2][k].number}; };
        s.place = {column(0), column(1), column(2), column(3)};
    }
    std::vector<std::array<Vec, 3>> corners;  // in object space
    if (s.type == "triangle") corners.push_back({vec(j["vertices"][0]), vec(j["vertices"][1]), vec(j["vertices"][2])});
    if (s.type == "mesh") {
        const auto mesh = rayproof::read_mesh(path, j["file"].text);
        auto corner = [&](int i) { return Vec{mesh.vertices[i][0], mesh.vertices[i][1], mesh.vertices[i][2]}; };
        for (const auto& f : mesh.faces) corners.push_back({corner(f[0]), corner(f[1]), corner(f[2])});
    }
    for (const auto& [p, q, r] : corners) {
        auto baked = [&](Vec v) { v = s.place.point(v); return Vec{float(v.x), float(v.y), float(v.z)}; };
        s.faces.push_back({baked(p), baked(q), baked(r)});
        const auto& [a, b, c] = s.faces.back();
        const Vec world = (s.place.determinant() < 0 ? -1 : 1) * cross(b - a, c - a);
        s.normals.push_back(WORLD_NORMALS ? normalize(world) : s.place.normal(cross(q - p, r - p)));
    }
    return s;
}

int main(int count, char** words) try {
    if (count == 2 && std::string(words[1]) == "--capabilities") {
        std::cout << R"({"protocol": 1, "name": "lecture", "version": "1", "precision": "float64",
            "chained": true, "world_normals": )" << (WORLD_NORMALS ? "true" : "false")
                  << R"(, "epsilons": {"shadow": 1e-7}})";
        return 0;
    }
    if (count != 3) throw std::runtime_error("usage: lecture SCENE OUTPUT");
    const Json document = rayproof::read_scene(words[1]), &camera = document["camera"];
    Scene scene;
    scene.simplified = document["shading"].text == "simplified";
    for (const Json& one : document["shapes"].items) scene.shapes.push_back(read_shape(one, words[1]));
    for (const Json& one : document["lights"].items) scene.lights.push_back({vec(one["position"]), vec(one["flux"])});
    rayproof::Image image{int(camera["width"].number), int(camera["height"].number), {}};

    const Vec eye = vec(camera["eye"]), F = normalize(vec(camera["target"]) - eye);
    const Vec R = normalize(cross(F, vec(camera["up"]))), U = cross(R, F);
    const std::string clip = document["clip"].text;
    const double near = clip == "none" ? 0 : camera["near"].number, far = clip == "none" ? INF : camera["far"].number;
    const double tangent = std::tan(camera["fovy"].number * PI / 360), aspect = double(image.width) / image.height;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const double sx = 2 * (x + 0.5) / image.width - 1, sy = 1 - 2 * (y + 0.5) / image.height;
            const Vec d = normalize(F + (sx * aspect * tangent) * R + (sy * tangent) * U);
            const double along = clip == "depth" ? dot(d, F) : 1;
            const Hit hit = scene.nearest({eye, d, near / along, far / along});
            auto put = [&](const char* stage, const char* axes, Vec v) {
                for (int k = 0; k < 3; ++k) image.at(std::string(stage) + axes[k], x, y) = float(v[k]);
            };
            const bool any = hit.shape >= 0;
            const Vec p = any ? eye + hit.t * d : Vec{};
            Vec n = any ? hit.normal : Vec{}, E, M, L;
            const bool behind = dot(n, d) > 0;
            if (any && behind && scene.shapes[hit.shape].two_sided) n = -1.0 * n;
            for (std::size_t i = 0; i < scene.lights.size(); ++i) {
                const auto& [position, flux] = scene.lights[i];
                const Vec to = position - p;
                const double r = length(to), cosine = any && r > 0 ? dot(n, to) / r : 0;
                // The shadow ray starts a little above the surface, by a small multiple of doubles' spacing.
                const Vec start = p + (1e-12 * std::max({1.0, length(p), length(eye)})) * n;
                const bool lit = cosine > 0 && scene.nearest({start, position - start, 0, 1}).shape < 0;
                if (lit) E = E + (cosine * (scene.simplified ? 1 : 1 / (4 * PI * r * r))) * flux;
                image.at("visibility." + std::to_string(i), x, y) = lit;
            }
            if (any) {
                const Vec& albedo = scene.shapes[hit.shape].albedo;
                M = {albedo.x * E.x, albedo.y * E.y, albedo.z * E.z};
                const bool dark = behind && !scene.shapes[hit.shape].two_sided;
                L = (dark ? 0 : scene.simplified ? 1 : 1 / PI) * M;
            }
            put("ray.", "XYZ", d), put("position.", "XYZ", p), put("normal.", "XYZ", n);
            image.at("object.V", x, y) = float(hit.shape), image.at("face.V", x, y) = any ? float(hit.face) : -1.0f;
            image.at("distance.V", x, y) = float(hit.t);
            if (!scene.lights.empty()) put("irradiance.", "RGB", E), put("exitance.", "RGB", M), put("", "RGB", L);
        }
    image.write_exr(words[2]);
} catch (const std::exception& error) {
    std::cerr << "lecture: " << error.what() << "\n";
    return 1;
}
