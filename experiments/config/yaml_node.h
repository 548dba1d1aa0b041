#pragma once
// Text as YAML: the one place that decides what a user's YAML may hold. It is a part of YAML 1.2,
// so that a file says what it looks like it says, and no text of any kind can crash, hang or
// exhaust a reader:
//
//  - UTF-8, without control characters but tab and line breaks, also escaped ones; one document;
//  - keys are plain text, each once in its map; "<<" (a merge) is none;
//  - no tags and no aliases;
//  - at most 16 MiB, 64 levels and a million values.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace turbidock::config {

// What a document or a part of it says.
struct YamlTree {
  enum class Kind { kNothing, kText, kList, kMap };
  struct Entry {
    std::string key;  // of a map; empty in a list
    int line = 1;     // where it begins
    std::shared_ptr<const YamlTree> value;
  };

  Kind kind = Kind::kNothing;
  std::string text{};            // of kText
  bool plain = false;            // of kText: written without quotes
  std::vector<Entry> entries{};  // of kList and kMap, in their order
  int line = 1;
};

// A part of a YAML document and where it is: `path` is the dotted key, empty for the whole
// document.
struct YamlNode {
  std::shared_ptr<const YamlTree> tree;
  std::string file;
  std::string path;
  int line = 1;

  bool IsMap() const;
  bool IsList() const;
  // Of a map, in its order; ConfigError for another kind of node.
  std::vector<std::pair<std::string, YamlNode>> Entries() const;
  std::vector<YamlNode> Elements() const;  // of a list; none of anything else
  // The value of a key of this map, or nothing. For keys that no struct describes.
  std::optional<YamlNode> Find(const std::string& key) const;
  // Likewise of keys in dots, each in the map of the one before.
  std::optional<YamlNode> FindPath(const std::string& keys) const;
  std::optional<std::string> Text() const;  // of a scalar
  // This map with these values besides, and instead of its own of the same keys.
  YamlNode With(const std::vector<std::pair<std::string, YamlNode>>& more) const;
  // The value as YAML in one line, as it may stand in a list; the same for any comments and line
  // breaks.
  std::string OneLine() const;
  // The same for every spelling of a value: of numbers, spaces, and the order of keys.
  std::string Canonical() const;
  // "FILE:LINE: ", the beginning of a message about this node; and ConfigError with all of it.
  std::string Where() const;
  [[noreturn]] void Fail(const std::string& problem) const;
};

// A value and the key that it is for, in dots; without a key a group of keys, such as a file's. Its
// node says where it stands, for messages; files that it names are beside that file, or for a
// command line's --set in the working directory.
struct Assignment {
  std::string key;
  YamlNode value;
};

// The `file` of what a command line's --set says.
inline constexpr const char* kFromSet = "--set";

std::string ElementPath(const std::string& path, size_t index);  // "path[index]"

// Reads a file, or text as if it were a file of that name. Throws ConfigError when it cannot be
// read, is no YAML as above, holds nothing, more than one document, or no map. `allowed_tag`, such
// as "!!opencv-matrix", is read over.
YamlNode LoadYaml(const std::string& file);
YamlNode ParseYaml(const std::string& text, const std::string& file,
                   const std::string& allowed_tag = "");

// A value that stands in no file.
YamlNode TextNode(const std::string& text, const YamlNode& at);

// Any value, for what `at` names; its file, path and line are those of messages. Of the kind
// "nothing" for text that holds no document.
YamlNode ParseYamlValue(const std::string& text, YamlNode at, const std::string& allowed_tag = "");

// ConfigError about `at`, with the line, unless the text is UTF-8 without control characters but
// tab and line breaks.
void RequireText(const std::string& text, YamlNode at);

}  // namespace turbidock::config
