#include "experiments/config/yaml_node.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <sstream>

#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"
#include "sim/base/fields.h"

namespace turbidock::config {
namespace {

constexpr size_t kLongestText = size_t{16} << 20;
constexpr size_t kMostWritten = size_t{64} << 20;  // bytes, roughly, with aliases written out
constexpr size_t kBytesOfNode = 64;                // of its place in a tree
constexpr int kDeepest = 64;

using Kind = YamlTree::Kind;
using Tree = std::shared_ptr<const YamlTree>;

// A finished part, with what an alias to it costs.
struct Part {
  Tree tree;
  size_t written = kBytesOfNode;
  int depth = 1;
};

// Makes the tree as the parser goes through the text.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(YamlNode at, std::string allowed_tag)
      : at_(std::move(at)), allowed_tag_(std::move(allowed_tag)) {}

  // Of the document, null if there was none; ConfigError when a key of it was no text.
  const Tree& root() const {
    if (bad_key_) FailAt(bad_key_->first, bad_key_->second, "a key must be plain text");
    return root_.tree;
  }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) FailAt(mark, at_.path, "one YAML document ends and more follows");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (WantsKey()) return TakeBadKey(mark);
    Finish(Scalar(mark, Kind::kNothing, "", false), anchor, mark);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    RefuseTag(mark, tag);
    const bool plain = tag == "?";
    if (system::FirstNoText(value))
      FailAt(mark, WantsKey() ? open_.back().path : PathOfNext(),
             "holds a control character, '" + system::Shortened(system::Printable(value)) + "'");
    if (WantsKey()) return TakeKey(mark, value, plain);
    Finish(Scalar(mark, Kind::kText, value, plain), anchor, mark);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (WantsKey()) return TakeBadKey(mark);
    const auto known = anchored_.find(anchor);
    if (known == anchored_.end())
      FailAt(mark, PathOfNext(), "an alias cannot stand inside what its anchor names");
    Finish(known->second, 0, mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    Begin(mark, tag, anchor, Kind::kList);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    Begin(mark, tag, anchor, Kind::kMap);
  }
  void OnSequenceEnd() override { End(); }
  void OnMapEnd() override { End(); }

 private:
  // A list or map that has not ended.
  struct Open {
    YamlTree tree;
    std::string path;
    YAML::anchor_t anchor = 0;
    YAML::Mark mark;
    bool is_key = false;                 // which no list or map can be
    std::optional<YamlTree::Entry> key;  // of a map: given, its value not
    std::map<std::string, int> lines{};  // of the keys so far
    size_t written = kBytesOfNode;
    int depth = 1;  // of what is in it
  };

  static int LineOf(const YAML::Mark& mark) { return mark.is_null() ? 1 : mark.line + 1; }

  [[noreturn]] void FailAt(const YAML::Mark& mark, const std::string& path,
                           const std::string& problem) const {
    YamlNode at = at_;
    at.path = path;
    at.line = LineOf(mark);
    at.Fail(problem);
  }
  // Not an error yet: the parser may take an unfinished list for a key, and will say so.
  void TakeBadKey(const YAML::Mark& mark) {
    if (!bad_key_) bad_key_ = {mark, open_.back().path};
    open_.back().key = {"", LineOf(mark), nullptr};
  }

  bool WantsKey() const {
    return !open_.empty() && open_.back().tree.kind == Kind::kMap && !open_.back().key;
  }
  std::string PathOfNext() const {
    if (open_.empty()) return at_.path;
    const Open& parent = open_.back();
    return parent.key ? JoinKey(parent.path, parent.key->key)
                      : ElementPath(parent.path, parent.tree.entries.size());
  }

  void RefuseTag(const YAML::Mark& mark, const std::string& tag) const {
    const std::string standard = "tag:yaml.org,2002:";
    if (tag.empty() || tag == "?" || tag == "!") return;  // none; none, quoted
    const std::string shown = tag.starts_with(standard) ? "!!" + tag.substr(standard.size()) : tag;
    if (shown != allowed_tag_) FailAt(mark, PathOfNext(), "has a tag, " + shown + "; leave it out");
  }

  Part Scalar(const YAML::Mark& mark, Kind kind, const std::string& text, bool plain) const {
    YamlTree tree;
    tree.kind = kind;
    tree.text = text;
    tree.plain = plain;
    tree.line = LineOf(mark);
    return {std::make_shared<const YamlTree>(std::move(tree)), kBytesOfNode + text.size(), 1};
  }

  void TakeKey(const YAML::Mark& mark, const std::string& key, bool plain) {
    Open& map = open_.back();
    if (key == "<<" && plain)
      FailAt(mark, map.path, "a merge (<<) is not supported; write the keys out");
    const auto [first, is_new] = map.lines.emplace(key, LineOf(mark));
    if (!is_new)
      FailAt(mark, JoinKey(map.path, key),
             at_.file == kFromSet
                 ? "duplicate key"
                 : "duplicate key, first given in line " + std::to_string(first->second));
    map.key = {key, LineOf(mark), nullptr};
    map.written += kBytesOfNode + key.size();
  }

  void Begin(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, Kind kind) {
    RefuseTag(mark, tag);
    if (open_.size() >= kDeepest) FailDepth(mark);
    Open part{.tree = {},
              .path = PathOfNext(),
              .anchor = anchor,
              .mark = mark,
              .is_key = WantsKey(),
              .key = {}};
    part.tree.kind = kind;
    part.tree.line = LineOf(mark);
    open_.push_back(std::move(part));
  }

  void End() {
    Open part = std::move(open_.back());
    open_.pop_back();
    if (part.is_key) return TakeBadKey(part.mark);
    Finish({std::make_shared<const YamlTree>(std::move(part.tree)), part.written, part.depth + 1},
           part.anchor, part.mark);
  }

  // Puts a finished part where it belongs.
  void Finish(const Part& part, YAML::anchor_t anchor, const YAML::Mark& mark) {
    if (anchor != 0) anchored_[anchor] = part;
    if (static_cast<int>(open_.size()) + part.depth > kDeepest + 1) FailDepth(mark);
    if (open_.empty()) {
      root_ = part;
      return;
    }
    Open& parent = open_.back();
    parent.written += part.written;
    if (parent.written > kMostWritten)
      FailAt(mark, PathOfNext(), "is too large a document with every alias written out");
    parent.depth = std::max(parent.depth, part.depth);
    YamlTree::Entry entry = parent.key ? *parent.key : YamlTree::Entry{"", LineOf(mark), nullptr};
    parent.key.reset();
    entry.value = part.tree;
    parent.tree.entries.push_back(std::move(entry));
  }

  [[noreturn]] void FailDepth(const YAML::Mark& mark) const {
    FailAt(mark, "", "is nested deeper than " + std::to_string(kDeepest) + " levels");
  }

  YamlNode at_;
  std::string allowed_tag_;
  int documents_ = 0;
  Part root_;
  std::optional<std::pair<YAML::Mark, std::string>> bad_key_;  // and the map that it is in
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Part> anchored_;
};

// A node of the kind "nothing" for text that holds no document.
YamlNode Parse(const std::string& text, YamlNode at, const std::string& allowed_tag) {
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
    at.Fail("not valid YAML: " + error.msg);
  }
}

// Plain where it stays what it is.
void EmitText(const std::string& text, YAML::Emitter* out) {
  if (text == "<<") *out << YAML::DoubleQuoted;  // not a merge
  *out << text;
}

void Emit(const YamlTree& tree, YAML::Emitter* out) {
  switch (tree.kind) {
    case Kind::kNothing:
      *out << YAML::Null;
      return;
    case Kind::kText:
      EmitText(tree.text, out);
      return;
    case Kind::kList:
      *out << YAML::Flow << YAML::BeginSeq;
      for (const YamlTree::Entry& entry : tree.entries) Emit(*entry.value, out);
      *out << YAML::EndSeq;
      return;
    case Kind::kMap:
      *out << YAML::Flow << YAML::BeginMap;
      for (const YamlTree::Entry& entry : tree.entries) {
        *out << YAML::Key;
        EmitText(entry.key, out);
        *out << YAML::Value;
        Emit(*entry.value, out);
      }
      *out << YAML::EndMap;
  }
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
  for (const YamlTree::Entry& entry : tree->entries)
    if (entry.key == key) return YamlNode{entry.value, file, JoinKey(path, key), entry.line};
  return std::nullopt;
}

std::optional<std::string> YamlNode::Text() const {
  return tree->kind == Kind::kText ? std::optional(tree->text) : std::nullopt;
}

YamlNode YamlNode::With(const std::vector<std::pair<std::string, YamlNode>>& more) const {
  if (!IsMap()) Fail("must be a group of keys");
  YamlTree merged = *tree;
  for (const auto& [key, value] : more) {
    const auto same = [&name = key](const YamlTree::Entry& entry) { return entry.key == name; };
    const auto found = std::find_if(merged.entries.begin(), merged.entries.end(), same);
    if (found == merged.entries.end())
      merged.entries.push_back({key, value.line, value.tree});
    else
      *found = {key, value.line, value.tree};
  }
  YamlNode node = *this;
  node.tree = std::make_shared<const YamlTree>(std::move(merged));
  return node;
}

YamlNode TextNode(const std::string& text, const YamlNode& at) {
  YamlTree tree;
  tree.kind = Kind::kText;
  tree.text = text;
  tree.plain = true;
  tree.line = at.line;
  YamlNode node = at;
  node.tree = std::make_shared<const YamlTree>(std::move(tree));
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
  char hex[8];
  std::snprintf(hex, sizeof hex, "0x%02x", byte);
  at.Fail(byte < 0x80 ? std::string("holds a control character (") + hex + ")"
                      : std::string("is no UTF-8 text (byte ") + hex + ")");
}

YamlNode LoadYaml(const std::string& file) { return ParseYaml(system::ReadWhole(file), file); }

YamlNode ParseYaml(const std::string& text, const std::string& file,
                   const std::string& allowed_tag) {
  YamlNode root = Parse(text, {nullptr, file, ""}, allowed_tag);
  if (root.tree->kind == Kind::kNothing) throw ConfigError(file + ": is empty");
  root.line = root.tree->line;
  if (!root.IsMap())
    root.Fail("is " + (root.IsList() ? "a list" : "'" + system::Shortened(root.tree->text) + "'") +
              ", must be a group of keys");
  return root;
}

YamlNode ParseYamlValue(const std::string& text, const YamlNode& at,
                        const std::string& allowed_tag) {
  return Parse(text, at, allowed_tag);
}

}  // namespace turbidock::config
