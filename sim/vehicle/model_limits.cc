#include "sim/vehicle/model_limits.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "sim/base/check.h"
#include "sim/base/fields.h"

namespace turbidock::vehicle {
namespace {

namespace fs = std::filesystem;

// The most that an attribute may ask for, each of its numbers. MuJoCo allocates it, whatever the
// machine has, or fills it for minutes. Ours: far more than any scene here needs; nstack counts
// numbers of 8 bytes, a texture's and height field's sides pixels and points.
struct Limit {
  std::string_view tag;
  std::string_view attribute;  // empty: every other
  double most;
};
constexpr Limit kLimits[] = {
    {"size", "nstack", 1e7},    {"size", "", 5000},         {"hfield", "nrow", 2048},
    {"hfield", "ncol", 2048},   {"texture", "width", 2048}, {"texture", "height", 2048},
    {"composite", "count", 50}, {"numeric", "size", 1e4},   {"user", "dim", 1e4},
};

[[noreturn]] void Fail(const Tag& tag, const std::string& where, const std::string& key,
                       const std::string& value, const std::string& what) {
  std::string said = where;
  said.append("<").append(tag.name).append(" ").append(key).append("=\"").append(value);
  throw ConfigError(said + "\">" + what);
}

void RequireNumbers(const Tag& tag, const std::string& where) {
  for (const auto& [key, value] : tag.attributes) {
    const auto* limit =
        std::ranges::find_if(kLimits, [&, name = std::string_view(key)](const Limit& l) {
          return l.tag == tag.name && (l.attribute == name || l.attribute.empty());
        });
    if (limit == std::end(kLimits)) continue;
    std::istringstream words(value);
    for (std::string word; words >> word;) {
      const bool is_plain = word.find('&') == std::string::npos;  // and no character reference
      if (is_plain && std::strtod(word.c_str(), nullptr) <= limit->most) continue;
      Fail(tag, where, key, value, ": must be at most " + FormatNumber(limit->most));
    }
  }
}

// POINT, POINT/TEXTURE, POINT//NORMAL or POINT/TEXTURE/NORMAL, 0 for what is left out; nothing
// where it is none of these.
std::optional<std::array<int64_t, 3>> CornerOf(const std::string& word) {
  std::array<int64_t, 3> corner = {0, 0, 0};
  std::istringstream numbers(word);
  std::string number;
  size_t count = 0;
  for (; std::getline(numbers, number, '/'); ++count) {
    const std::string digits = number.starts_with('-') ? number.substr(1) : number;
    const bool is_whole = digits.find_first_not_of("0123456789") == std::string::npos;
    if (count >= corner.size() || !is_whole || (digits.empty() && (count != 1 || number == "-")))
      return std::nullopt;
    corner[count] = std::strtoll(number.c_str(), nullptr, 10);
  }
  if (corner[0] == 0 || word.ends_with('/')) return std::nullopt;
  return corner;
}

// MuJoCo 2.2 follows a face to points that are not there, also where a corner names no texture
// point or normal in a file that has some.
void RequireFaces(const fs::path& path, const std::string& bytes) {
  const bool is_text = std::ranges::none_of(
      bytes, [](unsigned char c) { return c < ' ' && c != '\t' && c != '\r' && c != '\n'; });
  if (!is_text) throw ConfigError(path.string() + ": holds control characters");
  std::string rows = bytes;
  for (size_t i = 0; i + 1 < rows.size(); ++i)  // a row may end with a mere carriage return
    if (rows[i] == '\r' && rows[i + 1] != '\n') rows[i] = '\n';
  std::istringstream text(rows);
  std::array<int64_t, 3> points = {0, 0, 0};  // v, vt, vn
  constexpr std::array kNames = {"point", "texture point", "normal"};
  struct Corner {
    int line;
    std::array<int64_t, 3> point;  // 0: none
  };
  std::vector<Corner> corners;
  const auto fail = [&](int line, const std::string& what) {
    throw ConfigError(path.string() + ":" + std::to_string(line) + ": " + what);
  };
  const auto require = [&](bool is_there, const Corner& corner, size_t i) {
    if (!is_there)
      fail(corner.line, std::string("a face names ") + kNames[i] + " " +
                            std::to_string(corner.point[i]) + ", the file has " +
                            std::to_string(points[i]));
  };
  std::string row;
  for (int line = 1; std::getline(text, row); ++line) {
    std::istringstream words(row);
    std::string word;
    if (!(words >> word)) continue;
    for (size_t i = 0; i < points.size(); ++i) {
      if (word != std::array{"v", "vt", "vn"}[i]) continue;
      ++points[i];
      constexpr std::array kLeast = {3, 1, 3};
      double number = 0;
      int numbers = 0;
      while (numbers < kLeast[i] && words >> number) ++numbers;
      if (numbers < kLeast[i])
        fail(line, std::string("a ") + kNames[i] + " must have " + std::to_string(kLeast[i]) +
                       (kLeast[i] == 1 ? " number" : " numbers"));
    }
    if (word == "l" || word == "p") fail(line, "lines and points are no surface: leave them out");
    if (word != "f") continue;
    while (words >> word) {
      const auto point = CornerOf(word);
      if (!point) fail(line, "'" + word + "' is no point of a face");
      const Corner corner{.line = line, .point = *point};
      // counted back from the face
      for (size_t i = 0; i < points.size(); ++i) require(corner.point[i] >= -points[i], corner, i);
      corners.push_back(corner);
    }
  }
  if (corners.empty() && (points[0] < 4 || points[2] > 0))  // the hull of points alone
    throw ConfigError(path.string() +
                      ": has no faces; points alone are at least four, without normals");
  for (const Corner& corner : corners)
    for (size_t i = 0; i < points.size(); ++i) {
      require(corner.point[i] <= points[i], corner, i);
      if (corner.point[i] == 0 && points[i] > 0)
        fail(corner.line, std::string("a face names no ") + kNames[i] + ", the file has " +
                              std::to_string(points[i]) +
                              ": each corner must name one, or the file have none");
    }
}

// The same of a mesh that is written out.
void RequireFaces(const Tag& tag, const std::string& where) {
  const auto numbers = [&](const char* attribute) {
    std::istringstream words(tag.attribute(attribute));
    return std::vector<double>(std::istream_iterator<double>(words), {});
  };
  const std::string face = tag.attribute("face");
  if (face.find('&') != std::string::npos) Fail(tag, where, "face", face, ": must be numbers");
  const size_t count = numbers("vertex").size() / 3;
  const auto points = static_cast<double>(count);
  for (const double point : numbers("face"))
    if (!(point >= 0 && point < points))
      throw ConfigError(where + "<mesh face>: names point " + FormatNumber(point) +
                        ", the mesh has " + std::to_string(count) + ", the first is 0");
}

// From the header alone.
void RequirePixels(const fs::path& path, const std::string& png) {
  constexpr uint64_t kMostPixels = 1 << 26;
  constexpr size_t kWidthAt = 16, kHeightAt = 20, kHeader = 24;
  if (png.size() < kHeader) return;
  const auto number = [&](size_t at) {
    uint64_t n = 0;
    for (size_t i = at; i < at + 4; ++i) n = n << 8 | static_cast<unsigned char>(png[i]);
    return n;
  };
  if (number(kWidthAt) * number(kHeightAt) > kMostPixels)
    throw ConfigError(path.string() + ": is of more than 64 million pixels");
}

}  // namespace

std::string ReadModelFile(const fs::path& path) {
  constexpr std::uintmax_t kMostBytes = 64 << 20;
  std::error_code unreadable;  // said below
  const std::uintmax_t size = fs::file_size(path, unreadable);
  if (!unreadable && size > kMostBytes)
    throw ConfigError(path.string() + ": is larger than 64 MiB");
  std::ostringstream bytes;
  std::ifstream in(path, std::ios::binary);
  const bool is_empty = in && in.peek() == std::ifstream::traits_type::eof();
  if (in.bad() || (!is_empty && !(bytes << in.rdbuf())))
    throw ConfigError(path.string() + ": cannot be read");
  if (is_empty) throw ConfigError(path.string() + ": is empty");
  return bytes.str();
}

std::vector<std::string> FilesOf(const Tag& tag) {
  constexpr std::array kWithFiles = {"mesh", "texture", "hfield"};
  std::vector<std::string> files;
  if (std::ranges::find(kWithFiles, tag.name) == kWithFiles.end()) return files;
  for (const auto& [key, value] : tag.attributes)  // file, and fileright and others of a cube
    if (key.starts_with("file") && !value.empty()) files.push_back(value);
  return files;
}

void RequireModest(const Tag& tag, const std::string& where) {
  // MuJoCo believes the counts in a skin's file, whatever its length.
  if (tag.name == "skin")
    throw ConfigError(where + "<skin> bends, and all that docks is rigid: leave it out");
  RequireNumbers(tag, where);
  if (tag.name == "mesh") RequireFaces(tag, where);
  std::vector<std::string> files = FilesOf(tag);
  if (tag.name == "include") files.push_back(tag.attribute("file"));
  for (const std::string& file : files)
    if (fs::path(file).filename().empty()) Fail(tag, where, "file", file, " names no file");
}

void RequireSound(const fs::path& path, const std::string& bytes) {
  std::string kind = path.extension();
  std::ranges::transform(kind, kind.begin(), [](unsigned char c) { return std::tolower(c); });
  if (kind == ".obj") RequireFaces(path, bytes);
  if (bytes.starts_with("\x89PNG")) RequirePixels(path, bytes);
}

}  // namespace turbidock::vehicle
