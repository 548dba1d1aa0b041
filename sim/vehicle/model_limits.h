#pragma once
// What MuJoCo 2.2 does not survive in a model's files, or would take gigabytes and minutes for:
// each a ConfigError, with file and line, before MuJoCo sees it.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/vehicle/mjcf_tags.h"

namespace turbidock::vehicle {

// The whole file, of at most 64 MiB. One that is empty or cannot be read is a ConfigError.
std::string ReadModelFile(const std::filesystem::path& path);

// The meshes and pictures that a tag names, as it names them.
std::vector<std::string> FilesOf(const Tag& tag);

// Of a tag, which stands at `where` ("FILE:LINE: "): no skin, no file without a name, no
// face without its points, no number that asks for more memory than any scene here needs.
void RequireModest(const Tag& tag, const std::string& where);

// Of a mesh or picture and what it holds: an OBJ's faces have the points that they name, a PNG is
// of at most 64 million pixels.
void RequireSound(const std::filesystem::path& path, const std::string& bytes);

}  // namespace turbidock::vehicle
