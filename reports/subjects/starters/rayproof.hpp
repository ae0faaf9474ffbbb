// rayproof's protocol for a C++17 program: reads requests and scenes, writes images of named channels.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace rayproof {

// A JSON value; only the parts of JSON that scenes use.
struct Json {
    double number = 0;
    bool flag = false;
    std::string text;
    std::vector<Json> items;
    std::map<std::string, Json> members;

    const Json& operator[](const std::string& name) const {
        auto member = members.find(name);
        if (member == members.end()) throw std::runtime_error("the scene has no " + name);
        return member->second;
    }
    const Json& operator[](std::size_t index) const { return items.at(index); }
    bool has(const std::string& name) const { return members.count(name) > 0; }
    std::vector<double> numbers() const {
        std::vector<double> all;
        for (const Json& item : items) all.push_back(item.number);
        return all;
    }
};

class JsonReader {
public:
    explicit JsonReader(const std::string& text) : at(text.c_str()) {}

    Json value() {
        Json json;
        switch (next()) {
        case '{':
            for (++at; next() != '}'; next() == ',' ? ++at : at) {
                std::string name = string();
                expect(':');
                json.members[name] = value();
            }
            ++at;
            break;
        case '[':
            for (++at; next() != ']'; next() == ',' ? ++at : at) json.items.push_back(value());
            ++at;
            break;
        case '"': json.text = string(); break;
        case 't': json.flag = true; at += 4; break;
        case 'f': at += 5; break;
        case 'n': at += 4; break;
        default: {
            char* end;
            json.number = std::strtod(at, &end);
            if (end == at) throw std::runtime_error("the scene is not JSON");
            at = end;
        }
        }
        return json;
    }

private:
    const char* at;

    char next() {
        while (*at == ' ' || *at == '\n' || *at == '\t' || *at == '\r') ++at;
        if (!*at) throw std::runtime_error("the scene ends too early");
        return *at;
    }
    void expect(char wanted) {
        if (next() != wanted) throw std::runtime_error(std::string("the scene is not JSON: no ") + wanted);
        ++at;
    }
    std::string string() {  // names and paths, which contain no escapes
        expect('"');
        std::string text;
        while (next() != '"') text += *at++;
        ++at;
        return text;
    }
};

// A text as a JSON string.
inline std::string quoted(const std::string& text) {
    std::string json = "\"";
    for (char c : text) {
        if (c == '"' || c == '\\') json += '\\';
        json += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
    return json + '"';
}

inline std::string read_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot read " + path);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline Json read_scene(const std::string& path) { return JsonReader(read_file(path)).value(); }

// A mesh file in the scene's folder: OBJ with "v x y z" and "f a b c" lines.
struct Mesh {
    std::vector<std::vector<double>> vertices;
    std::vector<std::vector<int>> faces;
};

inline Mesh read_mesh(const std::string& scene_path, const std::string& file) {
    std::istringstream lines(read_file(scene_path.substr(0, scene_path.find_last_of('/') + 1) + file));
    Mesh mesh;
    std::string kind;
    while (lines >> kind) {
        double x, y, z;
        lines >> x >> y >> z;
        if (kind == "v") mesh.vertices.push_back({x, y, z});
        if (kind == "f") mesh.faces.push_back({int(x) - 1, int(y) - 1, int(z) - 1});
    }
    return mesh;
}

// Values are rounded to float only here: a program that computes later stages from its doubles may declare "chained".
// Channels by name, each width * height numbers with row 0 at the top; std::map sorts them, as OpenEXR requires.
struct Image {
    int width, height;
    std::map<std::string, std::vector<float>> channels;

    float& at(const std::string& name, int x, int y) {
        auto& channel = channels[name];
        if (channel.empty()) channel.resize(std::size_t(width) * height);
        return channel[std::size_t(y) * width + x];
    }

    // Source: "OpenEXR File Layout", openexr.com. Scan lines, uncompressed, 32-bit floats, on a little-endian machine.
    void write_exr(const std::string& path) const {
        std::string bytes;
        auto number = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
        auto name = [&](const std::string& text) { bytes.append(text.c_str(), text.size() + 1); };
        auto attribute = [&](const char* key, const char* type, std::size_t size) {
            name(key), name(type), number(std::int32_t(size));
        };
        number(std::int32_t(20000630)), number(std::int32_t(2));
        std::size_t list = 1;
        for (auto& [key, pixels] : channels) list += key.size() + 17;
        attribute("channels", "chlist", list);
        for (auto& [key, pixels] : channels) {
            name(key), number(std::int32_t(2)), number(std::int32_t(0));  // 2: float
            number(std::int32_t(1)), number(std::int32_t(1));
        }
        bytes += '\0';
        attribute("compression", "compression", 1), bytes += '\0';
        for (const char* window : {"dataWindow", "displayWindow"}) {
            attribute(window, "box2i", 16);
            for (int corner : {0, 0, width - 1, height - 1}) number(std::int32_t(corner));
        }
        attribute("lineOrder", "lineOrder", 1), bytes += '\0';
        attribute("pixelAspectRatio", "float", 4), number(1.0f);
        attribute("screenWindowCenter", "v2f", 8), number(0.0f), number(0.0f);
        attribute("screenWindowWidth", "float", 4), number(1.0f);
        bytes += '\0';
        const std::size_t line = channels.size() * width * 4, start = bytes.size() + std::size_t(height) * 8;
        for (int y = 0; y < height; ++y) number(std::uint64_t(start + y * (line + 8)));
        for (int y = 0; y < height; ++y) {
            number(std::int32_t(y)), number(std::int32_t(line));
            for (auto& [key, pixels] : channels)
                bytes.append(reinterpret_cast<const char*>(&pixels[std::size_t(y) * width]), std::size_t(width) * 4);
        }
        std::ofstream(path, std::ios::binary) << bytes;
    }
};

}  // namespace rayproof
