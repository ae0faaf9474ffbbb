// An adapter between rayproof and a renderer, with a working renderer of spheres; replace it by your own renderer.
//
//     c++ -O2 -std=c++17 -o adapter @FILE@
//     rayproof run --subject serve:./adapter --out report
//
// `serve:` starts it once for each worker; `--subject "exec:./adapter {scene} {output}"` calls it for each scene.
// rayproof.hpp, in the same folder, reads the scene and writes the image.
#include <array>
#include <iostream>

#include "rayproof.hpp"

using Json = rayproof::Json;
using Vec = std::array<double, 3>;
Vec vec(const Json& j) { return {j[0].number, j[1].number, j[2].number}; }
Vec add(Vec a, double s, Vec b) { return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]}; }
double dot(Vec a, Vec b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec cross(Vec a, Vec b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
Vec normalize(Vec a) { return add({}, 1 / std::sqrt(dot(a, a)), a); }

// The capabilities of this adapter. Cases that need others are reported as unsupported: neither passed nor failed.
// Add "chained": true if each stage is computed from the numbers that you write for the earlier stages.
std::string capabilities(int protocol) {
    return "{\"protocol\": " + std::to_string(protocol) +
           R"(, "name": "adapter", "version": "0", "precision": "float64",)"
           R"( "stages": ["ray", "object", "distance", "position", "normal"],)"
           R"( "shapes": ["sphere"], "affine": false})";
}

struct Hit { double t = INFINITY; int shape = -1; Vec normal{}; };

// YOUR RENDERER: the nearest hit of eye + t direction with low < t < high; normals of unit length, pointing outward.
Hit trace(const Json& scene, Vec eye, Vec direction, double low, double high) {
    Hit best;
    const auto& shapes = scene["shapes"].items;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        Vec center = vec(shapes[i]["center"]);
        double radius = shapes[i]["radius"].number;
        if (shapes[i].has("to_world")) {  // turned, moved and evenly scaled, since "affine" is false
            const Json& m = shapes[i]["to_world"];
            Vec moved{}, column{m[0][0].number, m[1][0].number, m[2][0].number};
            for (int k = 0; k < 3; ++k) moved[k] = dot(vec(m[k]), center) + m[k][3].number;
            center = moved, radius *= std::sqrt(dot(column, column));
        }
        const Vec from = add(eye, -1, center);
        const double b = dot(from, direction);
        const Vec off = add(from, -b, direction);
        const double d = radius * radius - dot(off, off);
        if (d < 0) continue;
        for (double t : {-b - std::sqrt(d), -b + std::sqrt(d)})
            if (t > low && t < high && t < best.t) {
                best = {t, int(i), normalize(add(from, t, direction))};
                break;
            }
    }
    return best;
}

void draw(const std::string& scene_path, const std::string& output) {
    const Json scene = rayproof::read_scene(scene_path), &camera = scene["camera"];
    rayproof::Image image{int(camera["width"].number), int(camera["height"].number), {}};
    const Vec eye = vec(camera["eye"]), F = normalize(add(vec(camera["target"]), -1, eye));
    const Vec R = normalize(cross(F, vec(camera["up"]))), U = cross(R, F);
    const double tangent = std::tan(camera["fovy"].number * std::acos(-1.0) / 360);
    const bool all = scene["clip"].text == "none";
    const double near = all ? 0 : camera["near"].number, far = all ? INFINITY : camera["far"].number;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            // A pixel's sample is its centre; row 0 is the top one.
            const double sx = (2 * (x + 0.5) - image.width) / image.height, sy = 1 - 2 * (y + 0.5) / image.height;
            const Vec d = normalize(add(add(F, sx * tangent, R), sy * tangent, U));
            const double along = scene["clip"].text == "depth" ? dot(d, F) : 1;
            Hit hit = trace(scene, eye, d, near / along, far / along);
            const bool any = hit.shape >= 0;
            const Json* shape = any ? &scene["shapes"][std::size_t(hit.shape)] : nullptr;
            const bool two_sided = shape && shape->has("two_sided") && (*shape)["two_sided"].flag;
            if (two_sided && dot(hit.normal, d) > 0) hit.normal = add({}, -1, hit.normal);
            const Vec p = any ? add(eye, hit.t, d) : Vec{};
            for (int k = 0; k < 3; ++k) {
                const std::string axis(1, "XYZ"[k]);
                image.at("ray." + axis, x, y) = float(d[k]);
                image.at("position." + axis, x, y) = float(p[k]);
                image.at("normal." + axis, x, y) = float(hit.normal[k]);
            }
            image.at("object.V", x, y) = float(hit.shape);
            image.at("face.V", x, y) = any ? 0.0f : -1.0f;
            image.at("distance.V", x, y) = float(hit.t);
        }
    image.write_exr(output);
}

// Answer requests, one JSON object per line, until standard input ends.
void serve() {
    for (std::string line; std::getline(std::cin, line);) {
        const Json request = rayproof::JsonReader(line).value();
        std::cout << "{\"id\": " << long(request["id"].number) << ", ";
        try {
            if (request.has("capabilities"))
                std::cout << "\"capabilities\": " << capabilities(2);
            else {
                draw(request["scene"].text, request["output"].text);
                std::cout << "\"ok\": true";
            }
        } catch (const std::exception& error) {
            std::cout << "\"error\": " << rayproof::quoted(error.what());
        }
        std::cout << "}" << std::endl;
    }
}

int main(int count, char** words) try {
    if (count == 2 && std::string(words[1]) == "--capabilities")
        std::cout << capabilities(1);
    else if (count == 3)
        draw(words[1], words[2]);
    else if (count == 1)
        serve();
    else
        throw std::runtime_error("usage: adapter SCENE OUTPUT, or nothing for requests on standard input");
} catch (const std::exception& error) {
    std::cerr << "adapter: " << error.what() << "\n";
    return 1;
}
