#include "experiments/config/yaml_node.h"

#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"
#include "sim/base/fields.h"

namespace turbidock::config {
namespace {

constexpr size_t kLongestText = size_t{16} << 20;
constexpr size_t kMostValues = size_t{1} << 20;  // what a text makes is many times as large
constexpr size_t kDeepest = 64;

using Kind = YamlTree::Kind;

// Makes the tree as the parser goes through the text.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(YamlNode at, std::string allowed_tag)
      : at_(std::move(at)), allowed_tag_(std::move(allowed_tag)) {}

  // Of the document, null if there was none; ConfigError when a key of it was no text.
  const std::shared_ptr<const YamlTree>& root() const {
    if (bad_key_) bad_key_->Fail("a key must be plain text");
    return root_;
  }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) FailAt(mark, at_.path, "one YAML document ends and more follows");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override {
    Add(NewTree(mark, "", Kind::kNothing));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                const std::string& value) override {
    if (system::FirstNoText(value))
      FailAt(mark, Path(),
             "holds a control character, '" + system::Shortened(system::Printable(value)) + "'");
    if (WantsKey()) return TakeKey(mark, value, tag);
    const auto tree = NewTree(mark, tag, Kind::kText);
    tree->text = value;
    tree->plain = tag == "?";
    Add(tree);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    FailAt(mark, Path(), "an alias (*) is not supported; write its value out");
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    open_.push_back({.tree = NewTree(mark, tag, Kind::kList)});
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    open_.push_back({.tree = NewTree(mark, tag, Kind::kMap)});
  }
  void OnSequenceEnd() override { End(); }
  void OnMapEnd() override { End(); }

 private:
  // A list or map that has not ended.
  struct Open {
    std::shared_ptr<YamlTree> tree;
    std::optional<YamlTree::Entry> key{};  // of a map: given, its value not
    std::map<std::string, int> lines{};    // of the keys so far
  };

  static int LineOf(const YAML::Mark& mark) { return mark.is_null() ? 1 : mark.line + 1; }

  YamlNode NodeAt(const YAML::Mark& mark, const std::string& path) const {
    return {nullptr, at_.file, path, LineOf(mark)};
  }
  [[noreturn]] void FailAt(const YAML::Mark& mark, const std::string& path,
                           const std::string& problem) const {
    NodeAt(mark, path).Fail(problem);
  }

  bool WantsKey() const {
    return !open_.empty() && open_.back().tree->kind == Kind::kMap && !open_.back().key;
  }
  // Of what comes next; of a key: of its map.
  std::string Path() const {
    std::string path = at_.path;
    for (const Open& part : open_)
      if (part.tree->kind == Kind::kList)
        path = ElementPath(path, part.tree->entries.size());
      else if (part.key)
        path = JoinKey(path, part.key->key);
    return path;
  }

  void RefuseTag(const YAML::Mark& mark, const std::string& tag) const {
    const std::string standard = "tag:yaml.org,2002:";
    if (tag.empty() || tag == "?" || tag == "!") return;  // none; none, quoted
    const std::string shown = tag.starts_with(standard) ? "!!" + tag.substr(standard.size()) : tag;
    if (shown != allowed_tag_) FailAt(mark, Path(), "has a tag, " + shown + "; leave it out");
  }

  std::shared_ptr<YamlTree> NewTree(const YAML::Mark& mark, const std::string& tag, Kind kind) {
    // Not an error yet: the parser may take an unfinished list for a key, and will say so.
    if (WantsKey() && !bad_key_) bad_key_ = NodeAt(mark, Path());
    if (++values_ > kMostValues)
      FailAt(mark, "", fmt::format("is too large, must have at most {} values", kMostValues));
    if (kind > Kind::kText && open_.size() >= kDeepest)
      FailAt(mark, "", fmt::format("is nested deeper than {} levels", kDeepest));
    RefuseTag(mark, tag);
    return std::make_shared<YamlTree>(YamlTree{.kind = kind, .line = LineOf(mark)});
  }

  void TakeKey(const YAML::Mark& mark, const std::string& key, const std::string& tag) {
    RefuseTag(mark, tag);
    Open& map = open_.back();
    if (key == "<<" && tag == "?")
      FailAt(mark, Path(), "a merge (<<) is not supported; write the keys out");
    const auto [first, is_new] = map.lines.emplace(key, LineOf(mark));
    if (!is_new)
      FailAt(mark, JoinKey(Path(), key),
             at_.file == kFromSet
                 ? "duplicate key"
                 : "duplicate key, first given in line " + std::to_string(first->second));
    map.key = {key, LineOf(mark), nullptr};
  }

  void End() {
    const std::shared_ptr<YamlTree> tree = std::move(open_.back().tree);
    open_.pop_back();
    Add(tree);
  }

  // Puts a finished part where it belongs.
  void Add(const std::shared_ptr<const YamlTree>& tree) {
    if (open_.empty()) {
      root_ = tree;
      return;
    }
    Open& parent = open_.back();
    if (WantsKey()) {
      parent.key = {"", tree->line, nullptr};
      return;
    }
    parent.tree->entries.push_back(parent.key.value_or(YamlTree::Entry{"", tree->line, nullptr}));
    parent.tree->entries.back().value = tree;
    parent.key.reset();
  }

  YamlNode at_;
  std::string allowed_tag_;
  int documents_ = 0;
  size_t values_ = 0;
  std::shared_ptr<const YamlTree> root_;
  std::optional<YamlNode> bad_key_;
  std::vector<Open> open_;
};

// Whether one of the first `lines` lines is indented with a tab, and which.
std::optional<int> TabIn(const std::string& text, int lines) {
  std::istringstream stream(text);
  std::string line;
  for (int i = 1; i <= lines && std::getline(stream, line); ++i)
    if (const size_t end = line.find_first_not_of(' '); end < line.size() && line[end] == '\t')
      return i;
  return std::nullopt;
}

// Plain where it stays what it is.
void EmitText(const std::string& text, YAML::Emitter* out) {
  if (text == "<<") *out << YAML::DoubleQuoted;  // not a merge
  *out << text;
}

void Emit(const YamlTree& tree, YAML::Emitter* out) {
  if (tree.kind == Kind::kText) return EmitText(tree.text, out);
  if (tree.kind == Kind::kNothing) {
    *out << YAML::Null;
    return;
  }
  const bool is_map = tree.kind == Kind::kMap;
  *out << YAML::Flow << (is_map ? YAML::BeginMap : YAML::BeginSeq);
  for (const YamlTree::Entry& entry : tree.entries) {
    if (is_map) EmitText(entry.key, out);
    Emit(*entry.value, out);
  }
  *out << (is_map ? YAML::EndMap : YAML::EndSeq);
}

}  // namespace

std::string ElementPath(const std::string& path, size_t index) {
  return path + "[" + std::to_string(index) + "]";
}

bool YamlNode::IsMap() const { return tree->kind == Kind::kMap; }
bool YamlNode::IsList() const { return tree->kind == Kind::kList; }

std::vector<std::pair<std::string, YamlNode>> YamlNode::Entries() const {
  if (!IsMap()) Fail("must be a group of keys");
  std::vector<std::pair<std::string, YamlNode>> entries;
  entries.reserve(tree->entries.size());
  for (const YamlTree::Entry& entry : tree->entries)
    entries.emplace_back(entry.key,
                         YamlNode{entry.value, file, JoinKey(path, entry.key), entry.line});
  return entries;
}

std::vector<YamlNode> YamlNode::Elements() const {
  std::vector<YamlNode> elements;
  if (IsList())
    for (const YamlTree::Entry& entry : tree->entries)
      elements.push_back({entry.value, file, ElementPath(path, elements.size()), entry.line});
  return elements;
}

std::optional<YamlNode> YamlNode::Find(const std::string& key) const {
  if (!IsMap()) return std::nullopt;
  const auto found = std::ranges::find(tree->entries, key, &YamlTree::Entry::key);
  if (found == tree->entries.end()) return std::nullopt;
  return YamlNode{found->value, file, JoinKey(path, key), found->line};
}

std::optional<YamlNode> YamlNode::FindPath(const std::string& keys) const {
  const size_t dot = keys.find('.');
  const std::optional<YamlNode> first = Find(keys.substr(0, dot));
  return first && dot != std::string::npos ? first->FindPath(keys.substr(dot + 1)) : first;
}

std::optional<std::string> YamlNode::Text() const {
  return tree->kind == Kind::kText ? std::optional(tree->text) : std::nullopt;
}

YamlNode YamlNode::With(const std::vector<std::pair<std::string, YamlNode>>& more) const {
  if (!IsMap()) Fail("must be a group of keys");
  YamlTree merged = *tree;
  for (const auto& [key, value] : more) {
    const auto found = std::ranges::find(merged.entries, key, &YamlTree::Entry::key);
    const YamlTree::Entry entry{key, value.line, value.tree};
    if (found == merged.entries.end())
      merged.entries.push_back(entry);
    else
      *found = entry;
  }
  YamlNode node = *this;
  node.tree = std::make_shared<const YamlTree>(std::move(merged));
  return node;
}

YamlNode TextNode(const std::string& text, const YamlNode& at) {
  YamlNode node = at;
  node.tree = std::make_shared<const YamlTree>(YamlTree{Kind::kText, text, true, {}, at.line});
  return node;
}

std::string YamlNode::OneLine() const {
  // In brackets, which are taken off again: text is then quoted where a comma would end it.
  YAML::Emitter out;
  out << YAML::Flow << YAML::BeginSeq;
  Emit(*tree, &out);
  out << YAML::EndSeq;
  std::string text(out.c_str() + 1, out.size() - 2);
  std::replace(text.begin(), text.end(), '\n', ' ');
  // in front of an empty group stands a space
  return text.starts_with(' ') ? text.substr(1) : text;
}

std::string YamlNode::Canonical() const {
  std::vector<std::string> parts;
  if (IsMap()) {
    for (const auto& [key, value] : Entries()) parts.push_back(key + ": " + value.Canonical());
    std::ranges::sort(parts);
    return fmt::format("{{{}}}", fmt::join(parts, ", "));
  }
  if (IsList()) {
    for (const YamlNode& element : Elements()) parts.push_back(element.Canonical());
    return fmt::format("[{}]", fmt::join(parts, ", "));
  }
  const std::string& text = tree->text;
  if (!tree->plain) return OneLine();
  const char *const begin = text.data(), *const end = begin + text.size();
  int64_t whole = 0;
  if (const auto [stop, error] = std::from_chars(begin, end, whole);
      error == std::errc{} && stop == end)
    return std::to_string(whole);
  double number = 0;
  if (const auto [stop, error] = std::from_chars(begin, end, number);
      error == std::errc{} && stop == end && std::isfinite(number))
    return FormatNumber(number);
  return OneLine();
}

std::string YamlNode::Where() const {
  return file == kFromSet ? file + " " : file + ":" + std::to_string(line) + ": ";
}

void YamlNode::Fail(const std::string& problem) const {
  throw ConfigError(Where() + (path.empty() ? "" : path + ": ") + problem);
}

void RequireText(const std::string& text, YamlNode at) {
  const std::optional<size_t> bad = system::FirstNoText(text);
  if (!bad) return;
  at.line += static_cast<int>(std::count(text.data(), text.data() + *bad, '\n'));
  const auto byte = static_cast<unsigned char>(text[*bad]);
  at.Fail(byte < 0x80 ? fmt::format("holds a control character (0x{:02x})", byte)
                      : fmt::format("is no UTF-8 text (byte 0x{:02x})", byte));
}

YamlNode ParseYamlValue(const std::string& text, YamlNode at, const std::string& allowed_tag) {
  RequireText(text, at);
  if (text.size() > kLongestText) at.Fail("is too large, must be at most 16 MiB");
  try {
    TreeBuilder builder(at, allowed_tag);
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    // The parser stays where it cannot go on (text that begins with a comma): no more than the
    // beginning of a second document is asked for.
    if (parser.HandleNextDocument(builder)) parser.HandleNextDocument(builder);
    at.tree = builder.root() ? builder.root() : std::make_shared<const YamlTree>();
    return at;
  } catch (const YAML::Exception& error) {
    if (!error.mark.is_null()) at.line = error.mark.line + 1;
    if (const std::optional<int> line = TabIn(text, at.line)) {
      at.line = *line;
      at.Fail("begins with a tab; YAML indents with spaces");
    }
    at.Fail("not valid YAML: " + error.msg);
  }
}

YamlNode LoadYaml(const std::string& file) { return ParseYaml(system::ReadWhole(file), file); }

YamlNode ParseYaml(const std::string& text, const std::string& file,
                   const std::string& allowed_tag) {
  YamlNode root = ParseYamlValue(text, {nullptr, file, ""}, allowed_tag);
  if (root.tree->kind == Kind::kNothing) throw ConfigError(file + ": is empty");
  root.line = root.tree->line;
  if (!root.IsMap())
    root.Fail("is " + (root.IsList() ? "a list" : "'" + system::Shortened(root.tree->text) + "'") +
              ", must be a group of keys");
  return root;
}

}  // namespace turbidock::config
