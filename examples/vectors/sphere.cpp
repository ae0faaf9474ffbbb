// Answer sphere.csv with a float32 sphere formula in C++: c++ -std=c++17 -O2 -ffp-contract=off sphere.cpp -o sphere
// ./sphere sphere.csv > answers.csv
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

struct Vector { float x, y, z; };
float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// The smallest t > 0, or infinity. Haines, Guenther, Akenine-Moeller, Ray Tracing Gems (2019), chapter 7.
float sphere(Vector o, Vector d, Vector center, float radius) {
    Vector f{o.x - center.x, o.y - center.y, o.z - center.z};
    float a = dot(d, d), b = -dot(f, d);
    if (a == 0) return INFINITY;
    float s = b / a;
    Vector closest{f.x + s * d.x, f.y + s * d.y, f.z + s * d.z};
    float discriminant = radius * radius - dot(closest, closest);
    if (discriminant < 0) return INFINITY;
    float q = b + std::copysign(std::sqrt(a * discriminant), b);
    float near = q != 0 ? (dot(f, f) - radius * radius) / q : 0, far = q / a;
    if (near > far) std::swap(near, far);
    return near > 0 ? near : far > 0 ? far : INFINITY;
}

std::vector<std::string> cells(const std::string& line) {
    std::vector<std::string> found;
    std::stringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) found.push_back(cell);
    return found;
}

int main(int, char** arguments) {
    std::ifstream file(arguments[1]);
    std::string line;
    std::getline(file, line);
    std::map<std::string, size_t> place;
    for (const std::string& name : cells(line)) place.emplace(name, place.size());
    std::puts("# name sphere.cpp\nid,hit,t");
    while (std::getline(file, line)) {
        std::vector<std::string> row = cells(line);
        auto number = [&](const std::string& name) { return std::stof(row[place.at(name)]); };
        auto vector = [&](const std::string& name) {
            return Vector{number(name + "_x"), number(name + "_y"), number(name + "_z")};
        };
        float t = sphere(vector("o"), vector("d"), vector("center"), number("radius"));
        std::printf("%s,%d,%.9g\n", row[0].c_str(), t < INFINITY, t);
    }
}
