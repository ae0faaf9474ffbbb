// The lecture's ray tracer with a switch for every mistake that people make in one: wrong on request, right without.
//
//     c++ -O2 -std=c++17 -o mistaken mistaken.cpp
//     ./mistaken --mistakes                                          lists them
//     rayproof run --subject "exec:./mistaken --mistake no_pi {scene} {output}"
//
// Several mistakes at once: --mistake no_pi,left_handed. `--only radiance` writes one stage alone.
// `python -m tests.harness.audit --diagnose` measures on it how many mistakes are named rightly. Those marked U have no hypothesis,
// those marked F are found by a fit.
#include <algorithm>
#include <array>
#include <iostream>
#include <limits>
#include <random>
#include <sstream>

#include "rayproof.hpp"

using Json = rayproof::Json;
// name, H: a mistake that the diagnosis knows, F: one that it finds by a fit, U: one that it does not know on purpose,
// what the program does
#define MISTAKES(_) \
    _(left_handed, H, "builds a left-handed camera, right = up x forward") \
    _(image_mirrored, H, "writes each row from right to left") \
    _(upside_down, H, "writes the bottom row first") \
    _(pixel_corner, H, "samples each pixel at its top left corner") \
    _(pixel_far_corner, H, "samples each pixel at its bottom right corner") \
    _(fovx_for_fovy, H, "takes fovy for the horizontal angle") \
    _(whole_angle, H, "takes the tangent of fovy instead of half of it") \
    _(no_aspect, H, "leaves the aspect ratio out") \
    _(aspect_inverted, H, "takes height over width for the aspect ratio") \
    _(degrees_for_radians, H, "takes degrees for radians in the tangent") \
    _(up_as_given, H, "takes the given up vector as it is, without making it orthogonal") \
    _(up_is_y, H, "takes y for up, whatever the scene says") \
    _(up_is_z, H, "takes z for up, whatever the scene says") \
    _(target_is_direction, H, "takes the target point for the viewing direction") \
    _(not_normalised, H, "does not normalise the ray") \
    _(depth_for_distance, H, "writes the depth along the viewing direction as distance") \
    _(linear_fov, F, "takes half of fovy itself instead of its tangent") \
    _(sine_fov, F, "takes the sine of half of fovy instead of its tangent") \
    _(fixed_fov, F, "sees 50 degrees, whatever the scene says") \
    _(diagonal_fov, F, "takes fovy for the angle of the diagonal, as if it were a length") \
    _(width_minus_one, F, "divides pixels by w - 1 and h - 1") \
    _(right_not_normalised, F, "does not normalise the right vector") \
    _(quarter_pixel, F, "samples each pixel a quarter from its top left corner") \
    _(tilted, F, "looks a degree too high") \
    _(fisheye, U, "spreads angles evenly over the image") \
    _(jittered, U, "samples each pixel at a random point") \
    _(blocks, U, "traces one ray for every two by two pixels") \
    _(transposed_matrix, H, "transposes the model matrix (row vectors)") \
    _(no_translation, H, "leaves out the translation of the model matrix") \
    _(scale_ignored, U, "leaves out the scale of the model matrix") \
    _(renormalised_direction, H, "normalises the direction in object space and takes t as it is") \
    _(moved_direction, H, "moves the direction like a point") \
    _(forward_matrix, H, "brings rays into object space by the model matrix instead of its inverse") \
    _(direction_by_normal_matrix, F, "brings directions into object space by the inverse transpose") \
    _(origin_untranslated, F, "brings origins into object space without the translation") \
    _(rays_by_inverse_transpose, F, "brings rays into object space by the inverse transpose") \
    _(far_root, H, "takes the larger root of the sphere") \
    _(small_root_only, H, "takes the smaller root of the sphere or none") \
    _(center_ignored, H, "puts every sphere at the origin of its object space") \
    _(radius_ignored, H, "gives every sphere radius 1") \
    _(diameter_for_radius, H, "takes the radius for a diameter") \
    _(unit_a, H, "takes A = 1 for a direction that is not a unit vector") \
    _(cube_entry_only, H, "takes where a ray enters the cube or none") \
    _(cube_doubled, H, "takes a cube from -1 to 1") \
    _(square_doubled, H, "takes a square from -1 to 1") \
    _(square_disc, H, "takes a disc for a square") \
    _(plane_one_sided, H, "hits planes from the front alone") \
    _(triangle_culled, H, "culls triangles that face away") \
    _(triangle_no_sum, H, "leaves out u + v <= 1") \
    _(first_hit, H, "takes the first shape that is hit, not the nearest") \
    _(last_hit, H, "takes the last shape that is hit, not the nearest") \
    _(last_face, F, "takes the last face of a mesh that is hit, not the nearest") \
    _(first_face, F, "takes the first face of a mesh that is hit, not the nearest") \
    _(farthest_face, F, "takes the farthest face of a mesh that is hit") \
    _(within_20m, F, "sees nothing that is 20 m away or farther") \
    _(farthest_hit, F, "takes the farthest hit") \
    _(behind_the_eye, H, "takes hits behind the eye") \
    _(clips_nothing, H, "clips nothing") \
    _(near_ignored, H, "ignores the near plane") \
    _(far_ignored, H, "ignores the far plane") \
    _(clips_by_shell, H, "clips at spheres around the eye") \
    _(clips_by_planes, H, "clips at planes where spheres are asked for") \
    _(normal_by_model, H, "turns normals by the model matrix") \
    _(normal_in_object_space, H, "leaves normals in object space") \
    _(normal_by_inverse, H, "turns normals by the inverse, not transposed") \
    _(normal_not_normalised, H, "does not normalise the world normal") \
    _(normal_to_viewer, H, "turns every normal towards the viewer") \
    _(normal_never_turned, H, "never turns a normal towards the viewer") \
    _(normal_by_model_unnormalised, F, "turns normals by the model matrix and does not normalise them") \
    _(facing_mixed, F, "tells front from back by the normal of object space and the ray of the world") \
    _(facing_by_object_ray, F, "tells front from back by the normal of the world and the ray of object space") \
    _(mirrored_two_sided, F, "turns normals of mirrored two-sided shapes away from the viewer") \
    _(normal_inward, H, "lets sphere normals point inward") \
    _(normal_keeps_center, H, "forgets the centre in the sphere normal") \
    _(cube_normal_unsigned, H, "forgets the sign of the cube normal") \
    _(bumps, U, "bends normals by a bump map") \
    _(smooth_mesh, U, "takes sphere-like normals for meshes, from their middle") \
    _(no_shadows, H, "traces no shadow_rays") \
    _(beyond_the_light, H, "lets shapes behind the light cast shadows") \
    _(offset_5cm, H, "starts shadow rays 5 cm above the surface") \
    _(offset_2cm, H, "starts shadow rays 2 cm above the surface") \
    _(blockers_behind, H, "counts blockers behind the point, too") \
    _(unit_shadow_rays, H, "normalises the shadow ray and compares with t < 1") \
    _(acne, H, "starts shadow rays on the surface as rounded to floats, without an offset") \
    _(spheres_block_alone, U, "lets spheres alone cast shadows") \
    _(faces_behind_pass, U, "lets light through shapes other than the nearest") \
    _(first_shadow_ray, U, "lets the shadow ray of light 0 answer for all lights") \
    _(not_by_itself, U, "lets no shape cast a shadow on itself, nor its neighbour in the list") \
    _(simplified_for_physical, H, "uses the simplified light throughout") \
    _(physical_for_simplified, H, "uses the physical light throughout") \
    _(no_four_pi, H, "takes flux for intensity, without 4 pi") \
    _(two_pi, H, "spreads the flux over a half sphere") \
    _(no_falloff, H, "leaves 1/r^2 out") \
    _(linear_falloff, H, "falls off with 1/r") \
    _(cubic_falloff, H, "falls off with 1/r^3") \
    _(eye_distance, U, "falls off with the distance to the eye") \
    _(softened_falloff, F, "falls off with 1/(1 + r^2)") \
    _(clamped_distance, F, "falls off with 1/max(r, 1)^2") \
    _(one_plus_r, F, "falls off with 1/(1 + r)^2") \
    _(attenuation, F, "falls off with 1/(1 + 0.09 r + 0.032 r^2)") \
    _(exponential_falloff, F, "falls off with exp(-0.1 r)/r^2") \
    _(range_window, H, "lets light end at 10 m by the window (1 - (r/10)^4)^2") \
    _(no_cosine, H, "leaves the cosine out") \
    _(cosine_squared, H, "squares the cosine") \
    _(cosine_power_1_5, H, "takes the cosine to the power of 1.5") \
    _(cosine_not_clamped, H, "neither clamps the cosine nor asks for the horizon") \
    _(cosine_absolute, H, "takes the absolute value of the cosine") \
    _(wrapped_cosine, F, "takes (1 + cosine) / 2") \
    _(smooth_cosine, F, "takes the smooth step of the cosine") \
    _(first_light, H, "adds the first light alone") \
    _(last_light_left_out, H, "leaves the last light out") \
    _(mean_of_lights, H, "takes the mean of the lights") \
    _(root_of_lights, F, "divides by the square root of the number of lights") \
    _(brightest_light, U, "takes the brightest light alone") \
    _(lights_clamped, H, "clamps the sum of the lights to 1") \
    _(ambient, U, "adds ambient light") \
    _(specular, U, "adds a specular highlight") \
    _(fog, U, "darkens with distance") \
    _(vignette, U, "darkens towards the corners by cos^4") \
    _(checker, U, "darkens every other cell of a checkerboard in space") \
    _(moved_lights, U, "puts lights 30 cm aside") \
    _(dark_rims, U, "darkens where the surface is seen at a grazing angle") \
    _(no_pi, H, "leaves out 1/pi") \
    _(pi_twice, H, "divides by pi twice") \
    _(two_for_pi, H, "divides by 2 instead of pi") \
    _(factor_1_3, H, "is too bright by a factor 1.3") \
    _(no_albedo, H, "leaves the albedo out") \
    _(albedo_squared, H, "multiplies by the albedo twice") \
    _(srgb_albedo, F, "takes albedos for sRGB and makes them linear") \
    _(albedo_power, F, "takes albedos to the power of 2.2") \
    _(next_albedo, U, "takes the albedo of the next shape") \
    _(back_seen, H, "shows one-sided surfaces from behind") \
    _(all_two_sided, H, "takes every surface for two-sided") \
    _(all_one_sided, H, "takes every surface for one-sided") \
    _(gamma_2_2, H, "writes radiance with gamma 2.2") \
    _(gamma_1_8, H, "writes radiance with gamma 1.8") \
    _(srgb, H, "writes radiance in sRGB") \
    _(clamped, H, "clamps radiance to 1") \
    _(eight_bits, H, "rounds radiance to 8 bits") \
    _(srgb_eight_bits, H, "writes radiance as sRGB of 8 bits") \
    _(bgr, H, "writes blue for red") \
    _(luminance, U, "writes the luminance") \
    _(reinhard, U, "maps radiance to L / (1 + L)") \
    _(radiance_mirrored, H, "writes each row of radiance from right to left, the other stages rightly") \
    _(radiance_upside_down, H, "writes the bottom row of radiance first, the other stages rightly") \
    _(columns_first, H, "writes the image column by column") \
    _(height_for_stride, H, "takes the height for the distance between rows in memory") \
    _(rows_padded, H, "writes rows that are padded to 32 pixels as if they were not") \
    _(one_pixel_late, H, "writes each pixel one place too late") \
    _(strip_undrawn, H, "does not draw the fourth of five strips of rows") \
    _(rows_left_over, H, "draws seven strips of equal height, and not what is left over") \
    _(tiles_undrawn, H, "does not draw every third tile of 32 by 32 pixels") \
    _(wrapped_bytes, H, "writes radiance modulo 256 steps of 1/255") \
    _(bytes_swapped, H, "writes the bytes of floats in the other order") \
    _(half_floats, H, "writes 16-bit floats, whose largest is 65504") \
    _(changing, U, "leaves some pixels as they were in memory, others in each call")

enum Mistake {
#define _(name, known, what) name,
    MISTAKES(_)
#undef _
    COUNT
};
struct Entry { const char *name, *known, *what; };
const Entry ENTRIES[] = {
#define _(name, known, what) {#name, #known, what},
    MISTAKES(_)
#undef _
};
bool made[COUNT] = {};
inline bool is(Mistake one) { return made[one]; }

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
    Vec inverse_transpose(Vec n) const {  // its columns are the cofactors over the determinant
        return (1 / determinant()) * (n.x * cross(b, c) + n.y * cross(c, a) + n.z * cross(a, b));
    }
    Vec normal(Vec n) const {
        Vec turned = inverse_transpose(n);
        if (is(normal_by_model)) turned = turn(n);
        if (is(normal_in_object_space)) turned = n;
        if (is(normal_by_inverse)) turned = back(n);
        if (is(normal_by_model_unnormalised)) return turn(n);
        return is(normal_not_normalised) ? turned : normalize(turned);
    }
};

struct Ray {
    Vec origin, direction;
    double low, high;
    // Of a shadow ray that counts blockers behind its start, not the surface that it starts on.
    bool holds(double t) const {
        const bool own = low < 0 && is(blockers_behind) && std::abs(t) * length(direction) <= 1e-6 * std::max(1.0, length(origin));
        return !own && t > low && t < high;
    }
};
struct Hit { double t = INF; int shape = -1, face = 0; Vec normal, local; };

struct Shape {
    std::string type;
    Vec albedo, center;
    double radius = 1;
    bool two_sided = false;
    Placement place;
    std::vector<std::array<Vec, 3>> faces;  // of triangles and meshes, as float32 numbers in the world
    std::vector<Vec> normals, locals;       // of these faces, in the world and in object space

    // Report t of a hit inside the ray's interval, with the normal in object space.
    template <class Found> void meet(const Ray& ray, Found found) const {
        if (!faces.empty()) return triangles(ray, found);
        Vec o = place.back(ray.origin - place.t), d = place.back(ray.direction);  // not normalized: t stays t
        if (is(moved_direction)) d = place.back(ray.direction - place.t);
        if (is(forward_matrix)) o = place.point(ray.origin), d = place.turn(ray.direction);
        if (is(renormalised_direction)) d = normalize(d);
        if (is(direction_by_normal_matrix)) d = place.inverse_transpose(ray.direction);
        if (is(origin_untranslated)) o = place.back(ray.origin);
        if (is(rays_by_inverse_transpose))
            o = place.inverse_transpose(ray.origin - place.t), d = place.inverse_transpose(ray.direction);
        auto inside = [&](double t) { return ray.holds(t); };
        if (type == "sphere") {
            const Vec from = is(center_ignored) ? o : o - center;
            const double A = is(unit_a) ? 1 : dot(d, d), B = dot(from, d);
            const double r = is(radius_ignored) ? 1 : is(diameter_for_radius) ? radius / 2 : radius;
            const Vec off = from - (B / A) * d;  // the discriminant without b^2 - 4ac's cancellation
            const double D = is(unit_a) ? B * B - dot(from, from) + r * r : A * (r * r - dot(off, off));
            if (D < 0) return;
            double roots[] = {(-B - std::sqrt(D)) / A, (-B + std::sqrt(D)) / A};
            if (is(far_root)) std::swap(roots[0], roots[1]);
            for (double t : roots) {
                if (inside(t)) {
                    Vec n = (is(normal_keeps_center) ? o + t * d : from + t * d);
                    n = (1 / (is(normal_keeps_center) ? length(n) : r)) * n;
                    return found(t, 0, place.normal(is(normal_inward) ? -1.0 * n : n), n);
                }
                if (is(small_root_only)) return;
            }
        } else if (type == "cube") {
            double low = -INF, high = INF;
            int first = 0, last = 0;
            for (int k = 0; k < 3; ++k) {
                const double h = is(cube_doubled) ? 1 : 0.5;
                if (d[k] == 0 && std::abs(o[k]) > h) return;
                if (d[k] == 0) continue;
                double t0 = (-h - o[k]) / d[k], t1 = (h - o[k]) / d[k];
                if (t0 > t1) std::swap(t0, t1);
                if (t0 > low) low = t0, first = k;
                if (t1 < high) high = t1, last = k;
            }
            if (low > high) return;
            for (auto [t, axis] : {std::pair(low, first), std::pair(high, last)}) {
                if (inside(t)) {
                    Vec n;
                    n[axis] = o[axis] + t * d[axis] > 0 || is(cube_normal_unsigned) ? 1 : -1;
                    return found(t, 0, place.normal(n), n);
                }
                if (is(cube_entry_only)) return;
            }
        } else if (d.z != 0) {  // square or plane, in z = 0
            const double t = -o.z / d.z;
            const Vec p = o + t * d;
            const double h = is(square_doubled) ? 1 : 0.5;
            const bool disc = is(square_disc) && p.x * p.x + p.y * p.y < 0.25;
            if (type == "plane" && is(plane_one_sided) && d.z > 0) return;
            if (inside(t) && (type == "plane" || (is(square_disc) ? disc : std::abs(p.x) < h && std::abs(p.y) < h)))
                found(t, 0, place.normal({0, 0, 1}), Vec{0, 0, 1});
        }
    }

    // Woop, Benthin and Wald (2013): no ray slips between two triangles, unless a compiler fuses product and difference.
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
            if (det == 0) continue;
            if (is(triangle_culled) && dot(ray.direction, normals[i]) > 0) continue;
            bool outside = (u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0);
            if (is(triangle_no_sum)) outside = v / det < 0 || v / det > 1 || w / det < 0 || w / det > 1;
            const double t = (u * A.z + v * B.z + w * C.z) / det;
            if (!outside && ray.holds(t)) found(t, int(i), normals[i], locals[i]);
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
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            Hit own;  // of this shape, where a wrong face of it may count
            shapes[i].meet(ray, [&](double t, int face, Vec n, Vec local) {
                if (is(within_20m) && t >= 20) return;
                if (is(last_face) || is(first_face) || is(farthest_face)) {
                    if (own.shape < 0 || is(last_face) || (is(farthest_face) && t > own.t))
                        own = {t, int(i), face, n, local};
                    return;
                }
                bool nearer = t < best.t;
                if (is(first_hit)) nearer = best.shape < 0 || (best.shape == int(i) && t < best.t);
                if (is(last_hit)) nearer = best.shape < int(i) || t < best.t;
                if (is(farthest_hit)) nearer = best.shape < 0 || t > best.t;
                if (nearer) best = {t, int(i), face, n, local};
            });
            if (own.t < best.t) best = own;
        }
        return best;
    }

    // What a shadow ray meets between a point on shape `own` and a light: any hit inside the ray's interval.
    bool blocked(const Ray& ray, int own) const {
        bool met = false;
        const Hit seen = is(faces_behind_pass) ? nearest(ray) : Hit{};
        for (int i = 0; i < int(shapes.size()); ++i) {
            if (is(spheres_block_alone) && shapes[i].type != "sphere") continue;
            if (is(faces_behind_pass) && i != seen.shape + 1) continue;
            if (is(not_by_itself) && (i == own || i == own + 1)) continue;
            shapes[i].meet(ray, [&](double, int, Vec, Vec) { met = true; });
        }
        return met;
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
        if (is(transposed_matrix)) {
            auto row = [&](int k) { return Vec{rows[k][0].number, rows[k][1].number, rows[k][2].number}; };
            s.place = {row(0), row(1), row(2), column(3)};
        }
        if (is(no_translation)) s.place.t = {};
        if (is(scale_ignored)) s.place = {normalize(s.place.a), normalize(s.place.b), normalize(s.place.c), s.place.t};
    }
    if (is(all_two_sided)) s.two_sided = true;
    if (is(all_one_sided)) s.two_sided = false;
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
        s.locals.push_back(normalize(cross(q - p, r - p)));
        s.normals.push_back(s.place.normal(is(normal_by_model_unnormalised) ? s.locals.back() : cross(q - p, r - p)));
    }
    return s;
}

// Radiance as it is written.
double written(double L) {
    if (is(reinhard)) L = L / (1 + L);
    if (is(gamma_2_2)) L = std::pow(std::max(L, 0.0), 1 / 2.2);
    if (is(gamma_1_8)) L = std::pow(std::max(L, 0.0), 1 / 1.8);
    if (is(srgb) || is(srgb_eight_bits)) L = L <= 0.0031308 ? 12.92 * L : 1.055 * std::pow(L, 1 / 2.4) - 0.055;
    if (is(clamped) || is(eight_bits) || is(srgb_eight_bits)) L = std::clamp(L, 0.0, 1.0);
    if (is(eight_bits) || is(srgb_eight_bits)) L = std::floor(255 * L + 0.5) / 255;
    return L;
}

// A number between 0 and 1 that looks random and is the same in every run.
double random(int x, int y, int k) {
    return std::fmod(std::abs(std::sin(x * 12.9898 + y * 78.233 + k * 37.719) * 43758.5453), 1.0);
}

// The nearest number that a 16-bit float holds, or infinity. Source: IEEE 754-2008, binary16.
float half(float value) {
    if (!(std::abs(value) < 65520)) return std::isnan(value) ? value : std::copysign(float(INF), value);
    const int exponent = value == 0 ? -24 : std::max(std::ilogb(value) - 10, -24);
    return std::ldexp(std::nearbyint(std::ldexp(value, -exponent)), exponent);
}

// What becomes of right values on their way into the file.
void damage(rayproof::Image& image) {
    const int w = image.width, h = image.height, count = w * h, padded = (w + 31) / 32 * 32;
    std::mt19937 drawn{std::random_device{}()};
    std::vector<bool> left(count);
    for (int i = 0; i < count; ++i) left[i] = drawn() % 50 == 0;
    for (auto& [name, pixels] : image.channels) {
        const std::vector<float> right = pixels;
        const bool radiance = name.size() == 1;
        if (is(height_for_stride)) std::fill(pixels.begin(), pixels.end(), 0.0f);
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                const int i = y * w + x;
                if (is(radiance_mirrored) && radiance) pixels[i] = right[y * w + w - 1 - x];
                if (is(radiance_upside_down) && radiance) pixels[i] = right[(h - 1 - y) * w + x];
                if (is(columns_first)) pixels[x * h + y] = right[i];
                if (is(height_for_stride) && y * h + x < count) pixels[y * h + x] = right[i];
                if (is(rows_padded)) pixels[i] = i % padded < w ? right[i / padded * w + i % padded] : 0;
                if (is(one_pixel_late)) pixels[i] = i > 0 ? right[i - 1] : 0;
                if (is(strip_undrawn) && y / ((h + 4) / 5) == 3) pixels[i] = 0;
                if (is(rows_left_over) && y >= h / 7 * 7) pixels[i] = 0;
                if (is(tiles_undrawn) && (x / 32 + y / 32) % 3 == 2) pixels[i] = 0;
                const auto steps = std::int64_t(255 * double(pixels[i]) + 0.5);
                if (is(wrapped_bytes) && radiance) pixels[i] = std::uint8_t(steps) / 255.0f;
                if (is(half_floats)) pixels[i] = half(pixels[i]);
                if (is(changing) && left[i]) pixels[i] = float(drawn() % 1000) / 1000;
                if (is(bytes_swapped)) {
                    auto* bytes = reinterpret_cast<unsigned char*>(&pixels[i]);
                    std::reverse(bytes, bytes + 4);
                }
            }
    }
}

int main(int count, char** words) try {
    std::vector<std::string> names;
    std::string only;
    for (int i = 1; i < count; ++i) {
        const std::string word = words[i];
        if (word == "--mistakes") {
            for (const Entry& one : ENTRIES) std::cout << one.name << "\t" << one.known << "\t" << one.what << "\n";
            return 0;
        }
        if (word == "--capabilities") {
            std::cout << R"({"protocol": 1, "name": "mistaken", "version": "1", "precision": "float64",
                "chained": true, "epsilons": {"shadow": 1e-7}})";
            return 0;
        }
        if (word == "--only" && i + 1 < count) only = words[++i];
        else if (word == "--mistake" && i + 1 < count) {
            std::istringstream list(words[++i]);
            for (std::string name; std::getline(list, name, ',');) {
                auto same = [&](const Entry& one) { return name == one.name; };
                const auto found = std::find_if(std::begin(ENTRIES), std::end(ENTRIES), same);
                if (found == std::end(ENTRIES)) throw std::runtime_error("no mistake is called " + name);
                made[found - ENTRIES] = true;
            }
        } else names.push_back(word);
    }
    if (names.size() != 2) throw std::runtime_error("usage: mistaken [--mistake NAMES] [--only radiance] SCENE OUTPUT");
    const Json document = rayproof::read_scene(names[0]), &camera = document["camera"];
    Scene scene;
    scene.simplified = document["shading"].text == "simplified";
    if (is(simplified_for_physical)) scene.simplified = true;
    if (is(physical_for_simplified)) scene.simplified = false;
    for (const Json& one : document["shapes"].items) scene.shapes.push_back(read_shape(one, names[0]));
    for (const Json& one : document["lights"].items) scene.lights.push_back({vec(one["position"]), vec(one["flux"])});
    rayproof::Image image{int(camera["width"].number), int(camera["height"].number), {}};

    const Vec eye = vec(camera["eye"]), target = vec(camera["target"]);
    Vec F = normalize(is(target_is_direction) ? target : target - eye);
    Vec up = vec(camera["up"]);
    if (is(up_is_y)) up = {0, 1, 0};
    if (is(up_is_z)) up = {0, 0, 1};
    Vec R = is(right_not_normalised) ? cross(F, up) : normalize(cross(F, up)), U = cross(R, F);
    if (is(left_handed)) R = -1.0 * R;
    if (is(up_as_given)) U = normalize(up);
    const Vec axis = F;  // of the planes that clip
    if (is(tilted)) F = std::cos(PI / 180) * axis + std::sin(PI / 180) * U, U = cross(R, F);
    const std::string clip = document["clip"].text;
    double near = clip == "none" ? 0 : camera["near"].number, far = clip == "none" ? INF : camera["far"].number;
    if (is(clips_nothing)) near = 0, far = INF;
    if (is(near_ignored)) near = 0;
    if (is(far_ignored)) far = INF;
    double tangent = std::tan(camera["fovy"].number * PI / 360), aspect = double(image.width) / image.height;
    if (is(whole_angle)) tangent = std::tan(camera["fovy"].number * PI / 180);
    if (is(degrees_for_radians)) tangent = std::tan(camera["fovy"].number / 2);
    if (is(linear_fov)) tangent = camera["fovy"].number * PI / 360;
    if (is(sine_fov)) tangent = std::sin(camera["fovy"].number * PI / 360);
    if (is(fixed_fov)) tangent = std::tan(25 * PI / 180);
    if (is(diagonal_fov)) tangent /= std::hypot(1, aspect);
    if (is(fovx_for_fovy)) tangent /= aspect;
    if (is(no_aspect)) aspect = 1;
    if (is(aspect_inverted)) aspect = 1 / aspect;
    const bool planes = clip == "depth" ? !is(clips_by_shell) : clip == "shell" && is(clips_by_planes);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            double column = x + 0.5, row = y + 0.5;
            if (is(pixel_corner)) column = x, row = y;
            if (is(pixel_far_corner)) column = x + 1, row = y + 1;
            if (is(quarter_pixel)) column = x + 0.25, row = y + 0.25;
            if (is(jittered)) column = x + random(x, y, 0), row = y + random(x, y, 1);
            if (is(blocks)) column = x - x % 2 + 1, row = y - y % 2 + 1;
            if (is(image_mirrored)) column = image.width - column;
            if (is(upside_down)) row = image.height - row;
            double sx = 2 * column / image.width - 1, sy = 1 - 2 * row / image.height;
            if (is(width_minus_one)) sx = 2.0 * x / (image.width - 1) - 1, sy = 1 - 2.0 * y / (image.height - 1);
            Vec d = F + (sx * aspect * tangent) * R + (sy * tangent) * U;
            if (is(fisheye)) {
                const double radius = std::hypot(sx * aspect, sy), angle = radius * std::atan(tangent);
                const double spread = radius > 0 ? std::tan(std::min(angle, 1.5)) / radius : 0;
                d = F + (sx * aspect * spread) * R + (sy * spread) * U;
            }
            if (!is(not_normalised)) d = normalize(d);
            const double along = planes ? dot(d, axis) : 1;
            const Hit hit = scene.nearest({eye, d, is(behind_the_eye) ? -INF : near / along, far / along});
            auto put = [&](const char* stage, const char* axes, Vec v) {
                for (int k = 0; k < 3; ++k) image.at(std::string(stage) + axes[k], x, y) = float(v[k]);
            };
            const bool any = hit.shape >= 0;
            const Vec p = any ? eye + hit.t * d : Vec{};
            Vec n = any ? hit.normal : Vec{}, E, M, L;
            if (any && is(bumps)) n = normalize(n + 0.2 * Vec{std::sin(7 * p.x), std::sin(7 * p.y), std::sin(7 * p.z)});
            if (any && is(smooth_mesh) && scene.shapes[hit.shape].type == "mesh") {
                Vec middle;
                for (const auto& [a, b, c] : scene.shapes[hit.shape].faces) middle = middle + a + b + c;
                n = normalize(p - (1.0 / (3 * scene.shapes[hit.shape].faces.size())) * middle);
            }
            const bool both = any && scene.shapes[hit.shape].two_sided;
            bool behind = dot(n, d) > 0;
            if (any && is(facing_mixed)) behind = dot(hit.local, d) > 0;
            if (any && is(facing_by_object_ray)) behind = dot(n, scene.shapes[hit.shape].place.back(d)) > 0;
            if (both && is(mirrored_two_sided) && scene.shapes[hit.shape].place.determinant() < 0) behind = !behind;
            if (behind && ((both && !is(normal_never_turned)) || is(normal_to_viewer))) n = -1.0 * n;
            const std::size_t lights = is(first_light) ? std::min<std::size_t>(1, scene.lights.size())
                : scene.lights.size() - (is(last_light_left_out) && !scene.lights.empty());
            bool first = false;
            double brightest = 0;
            for (std::size_t i = 0; i < scene.lights.size(); ++i) {
                const auto& [place, flux] = scene.lights[i];
                const Vec position = is(moved_lights) ? place + Vec{0.3, 0, 0} : place, to = position - p;
                const double r = length(to), cosine = any && r > 0 ? dot(n, to) / r : 0;
                const bool any_side = is(cosine_not_clamped) || is(cosine_absolute) || is(wrapped_cosine);
                // The shadow ray starts a little above the surface, by a small multiple of doubles' spacing.
                Vec start = p + (1e-12 * std::max({1.0, length(p), length(eye)})) * n;
                if (any_side && cosine < 0) start = 2.0 * p - start;  // on the side of the light
                if (is(offset_5cm)) start = p + 0.05 * n;
                if (is(offset_2cm)) start = p + 0.02 * n;
                if (is(acne)) start = {float(p.x), float(p.y), float(p.z)};
                const double low = is(blockers_behind) ? -INF : 0, high = is(beyond_the_light) ? INF : 1;
                const Vec shadow_ray = is(unit_shadow_rays) ? normalize(position - start) : position - start;
                const bool above = cosine > 0 || (any && any_side);
                bool lit = above && (is(no_shadows) || !scene.blocked({start, shadow_ray, low, high}, hit.shape));
                if (i == 0) first = lit;
                if (is(first_shadow_ray) && i > 0) lit = above && first;
                if (lit && i < lights) {
                    double c = cosine;
                    if (is(no_cosine)) c = 1;
                    if (is(cosine_squared)) c = c * c;
                    if (is(cosine_power_1_5)) c = std::pow(c, 1.5);
                    if (is(cosine_absolute)) c = std::abs(c);
                    if (is(wrapped_cosine)) c = (1 + c) / 2;
                    if (is(smooth_cosine)) c = c * c * (3 - 2 * c);
                    double fall = 1 / (4 * PI * r * r);
                    if (is(no_four_pi)) fall = 1 / (r * r);
                    if (is(two_pi)) fall = 1 / (2 * PI * r * r);
                    if (is(no_falloff)) fall = 1 / (4 * PI);
                    if (is(linear_falloff)) fall = 1 / (4 * PI * r);
                    if (is(cubic_falloff)) fall = 1 / (4 * PI * r * r * r);
                    if (is(eye_distance)) fall = 1 / (4 * PI * hit.t * hit.t);
                    if (is(softened_falloff)) fall = 1 / (4 * PI * (1 + r * r));
                    if (is(clamped_distance)) fall = 1 / (4 * PI * std::pow(std::max(r, 1.0), 2));
                    if (is(one_plus_r)) fall = 1 / (4 * PI * (1 + r) * (1 + r));
                    if (is(attenuation)) fall = 1 / (4 * PI * (1 + 0.09 * r + 0.032 * r * r));
                    if (is(exponential_falloff)) fall *= std::exp(-0.1 * r);
                    if (is(range_window)) fall *= std::pow(std::max(0.0, 1 - std::pow(r / 10, 4)), 2);
                    if (scene.simplified) c = std::min(c, 1.0);  // the normal may be longer than 1
                    const Vec part = (c * (scene.simplified ? 1 : fall)) * flux;
                    if (!is(brightest_light)) E = E + part;
                    else if (part.x + part.y + part.z > brightest) brightest = part.x + part.y + part.z, E = part;
                }
                image.at("visibility." + std::to_string(i), x, y) = lit;
            }
            if (is(mean_of_lights) && !scene.lights.empty()) E = (1.0 / scene.lights.size()) * E;
            if (is(root_of_lights) && !scene.lights.empty()) E = (1 / std::sqrt(double(scene.lights.size()))) * E;
            if (is(lights_clamped)) E = {std::min(E.x, 1.0), std::min(E.y, 1.0), std::min(E.z, 1.0)};
            if (any && is(ambient)) E = E + Vec{0.1, 0.1, 0.1};
            if (any) {
                const int owner = is(next_albedo) ? (hit.shape + 1) % int(scene.shapes.size()) : hit.shape;
                Vec albedo = is(no_albedo) ? Vec{1, 1, 1} : scene.shapes[owner].albedo;
                for (int k = 0; k < 3; ++k) {
                    const double a = albedo[k];
                    if (is(srgb_albedo)) albedo[k] = a <= 0.04045 ? a / 12.92 : std::pow((a + 0.055) / 1.055, 2.4);
                    if (is(albedo_power)) albedo[k] = std::pow(a, 2.2);
                }
                M = {albedo.x * E.x, albedo.y * E.y, albedo.z * E.z};
                if (is(albedo_squared)) M = {albedo.x * M.x, albedo.y * M.y, albedo.z * M.z};
                const bool dark = behind && !scene.shapes[hit.shape].two_sided && !is(back_seen);
                double scale = scene.simplified || is(no_pi) ? 1 : 1 / PI;
                if (is(pi_twice)) scale /= PI;
                if (is(two_for_pi) && !scene.simplified) scale = 0.5;
                if (is(factor_1_3)) scale *= 1.3;
                if (is(fog)) scale *= std::exp(-0.1 * hit.t);
                if (is(vignette)) scale *= std::pow(dot(normalize(d), F), 4);
                L = (dark ? 0 : scale) * M;
                if (is(checker) && int(std::floor(p.x) + std::floor(p.y) + std::floor(p.z)) % 2 != 0) L = 0.5 * L;
                if (is(dark_rims)) L = std::sqrt(std::abs(dot(n, normalize(d)))) * L;
                if (is(specular) && !dark) L = L + (0.3 * std::pow(std::abs(dot(n, normalize(d))), 20)) * E;
            }
            if (is(luminance)) L = (0.2126 * L.x + 0.7152 * L.y + 0.0722 * L.z) * Vec{1, 1, 1};
            if (is(bgr)) std::swap(L.x, L.z);
            L = {written(L.x), written(L.y), written(L.z)};
            put("ray.", "XYZ", d), put("position.", "XYZ", p), put("normal.", "XYZ", n);
            image.at("object.V", x, y) = float(hit.shape), image.at("face.V", x, y) = any ? float(hit.face) : -1.0f;
            image.at("distance.V", x, y) = float(is(depth_for_distance) && any ? hit.t * dot(d, F) : hit.t);
            if (!scene.lights.empty()) put("irradiance.", "RGB", E), put("exitance.", "RGB", M), put("", "RGB", L);
        }
    damage(image);
    if (only == "radiance")
        for (auto one = image.channels.begin(); one != image.channels.end();)
            one = one->first.size() == 1 ? std::next(one) : image.channels.erase(one);
    image.write_exr(names[1]);
} catch (const std::exception& error) {
    std::cerr << "mistaken: " << error.what() << "\n";
    return 1;
}
