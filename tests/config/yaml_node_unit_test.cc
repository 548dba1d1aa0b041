// What a user's YAML may hold, and how it is refused: nothing crashes, hangs or is taken for what
// it is not.

#include "experiments/config/yaml_node.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/message_of.h"

namespace turbidock::config {
namespace {

std::string ErrorOf(const std::string& text, const std::string& allowed_tag = "") {
  return testing::MessageOf([&] { ParseYaml(text, "a.yaml", allowed_tag); });
}

TEST(YamlNode, TextIsUtf8) {
  EXPECT_EQ(ErrorOf("a: 1\nname: caf\xe9\n"), "a.yaml:2: is no UTF-8 text (byte 0xe9)");
  EXPECT_EQ(ErrorOf("name: caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x90\x9f\n"), "no error");
  EXPECT_EQ(ErrorOf("\xef\xbb\xbfname: with a byte order mark\n"), "no error");
  // too long, a surrogate, beyond the last letter, cut off
  for (const char* bad : {"\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82"})
    EXPECT_NE(ErrorOf(std::string("name: ") + bad), "no error");
  EXPECT_EQ(ErrorOf(std::string("\xff\xfe"
                                "a\0:\0 \0"
                                "1\0",
                                10)),
            "a.yaml:1: is no UTF-8 text (byte 0xff)");
}

TEST(YamlNode, HasNoControlCharacters) {
  EXPECT_EQ(ErrorOf(std::string("a: x\0y\n", 7)), "a.yaml:1: holds a control character (0x00)");
  EXPECT_EQ(ErrorOf("a: \x1b[31m\n"), "a.yaml:1: holds a control character (0x1b)");
  EXPECT_EQ(ErrorOf("a: 1\t# tab\r\nb: 2\r\n"), "no error");
}

TEST(YamlNode, HasNoEscapedControlCharacters) {
  const auto error = [](const std::string& text) {
    return testing::MessageOf([&] { ParseYaml(text, "a.yaml"); });
  };
  EXPECT_EQ(error("a: [1, \"x\\0y\"]"), "a.yaml:1: a[1]: holds a control character, 'x\\x00y'");
  EXPECT_EQ(error("a: {\"\\e[31m\": 1}"), "a.yaml:1: a: holds a control character, '\\x1b[31m'");
  EXPECT_EQ(ParseYaml("a: \"x\\ty\\nz\"", "a.yaml").Find("a")->Text(), "x\ty\nz");
}

TEST(YamlNode, OneLineIsTheSameWhereverItStands) {
  for (const std::string text : {"plain",    "a, b", "x}",   "]",    "{",    "s #1: x/a, b.yaml",
                                 "- d.yaml", "<<",   "~",    "null", "12",   "'",
                                 "\"",       "a: b", "&a x", "*a",   "!x",   "%",
                                 "@",        "",     " x ",  "x\ny", "true", "ä, ö"}) {
    const std::string line = TextNode(text, {}).OneLine();
    const YamlNode root =
        ParseYaml("list: [" + line + ", 7]\nmap: {" + line + ": " + line +
                      ", k: 8}\nblock: " + line + "\n" + (text.empty() ? "" : line + ": 9\n"),
                  "a.yaml");
    EXPECT_EQ(root.Find("list")->Elements().size(), 2u) << line;
    EXPECT_EQ(root.Find("list")->Elements()[0].Text(), text) << line;
    EXPECT_EQ(root.Find("map")->Entries()[0].first, text) << line;
    EXPECT_EQ(root.Find("map")->Entries()[0].second.Text(), text) << line;
    EXPECT_EQ(root.Find("block")->Text(), text) << line;
    EXPECT_EQ(root.Find("list")->Elements()[0].OneLine(), line);
    if (!text.empty()) {
      EXPECT_EQ(root.Find(text)->Text(), "9") << line;
    }
  }
}

TEST(YamlNode, AKeyStandsOnceInEveryMap) {
  EXPECT_EQ(ErrorOf("grid:\n  a: [1]\n  b: {c: 1, c: 2}\n"),
            "a.yaml:3: grid.b.c: duplicate key, first given in line 3");
  EXPECT_EQ(ErrorOf("list:\n- {a: 1}\n- {a: 1,\n   a: 2}\n"),
            "a.yaml:4: list[1].a: duplicate key, first given in line 3");
  EXPECT_EQ(ErrorOf("list: [{a: 1}, {a: 1}]\n"), "no error");
}

TEST(YamlNode, AnAliasIsRefused) {
  const std::string refused = ": an alias (*) is not supported; write its value out";
  EXPECT_EQ(ErrorOf("grid: &a\n  b: [1, *a]\n"), "a.yaml:2: grid.b[1]" + refused);
  EXPECT_EQ(ErrorOf("a: &x {b: 1}\nc: *x\n"), "a.yaml:2: c" + refused);
  EXPECT_EQ(ErrorOf("a: &x b\n*x : 1\n"), "a.yaml:2" + refused);
}

TEST(YamlNode, TooManyValuesAreRefused) {
  std::string text = "a: [1";
  for (int i = 2; i < (1 << 20) - 1; ++i) text += ",1";  // with the map and the list
  EXPECT_EQ(ErrorOf(text + "]"), "no error");
  EXPECT_EQ(ErrorOf(text + ",1]"), "a.yaml:1: is too large, must have at most 1048576 values");
}

TEST(YamlNode, DepthIsLimited) {
  const auto nested = [](int levels, const std::string& inside) {
    return "a: " + std::string(static_cast<size_t>(levels), '[') + inside +
           std::string(static_cast<size_t>(levels), ']') + "\n";
  };
  EXPECT_EQ(ErrorOf(nested(63, "1")), "no error");
  EXPECT_EQ(ErrorOf(nested(64, "1")), "a.yaml:1: is nested deeper than 64 levels");
}

TEST(YamlNode, LargeTextIsRefused) {
  EXPECT_EQ(ErrorOf("a: " + std::string(17 << 20, 'x')),
            "a.yaml:1: is too large, must be at most 16 MiB");
}

TEST(YamlNode, ATabIsCalledATab) {
  const std::string tab = ": begins with a tab; YAML indents with spaces";
  EXPECT_EQ(ErrorOf("a: 1\nb:\n\tc: 2\n"), "a.yaml:3" + tab);
  EXPECT_EQ(ErrorOf("b:\n  c: 2\n \td: 3\n"), "a.yaml:3" + tab);
  EXPECT_EQ(ErrorOf("a: 1\t\nb: {c:\t2}\n"), "no error");
}

TEST(YamlNode, MergesAndTagsAreRefused) {
  EXPECT_EQ(ErrorOf("a: &x {b: 1}\nc:\n  <<: *x\n"),
            "a.yaml:3: c: a merge (<<) is not supported; write the keys out");
  EXPECT_EQ(ErrorOf("a: '<<'\nb: {'<<': 1}\n"), "no error");
  EXPECT_EQ(ErrorOf("a: !!binary abc\n"), "a.yaml:1: a: has a tag, !!binary; leave it out");
  EXPECT_EQ(ErrorOf("a: [!mine {b: 1}]\n"), "a.yaml:1: a[0]: has a tag, !mine; leave it out");
  EXPECT_EQ(ErrorOf("a: !!opencv-matrix {b: 1}\n", "!!opencv-matrix"), "no error");
  EXPECT_EQ(ErrorOf("a: !!opencv-matrix {b: !!int 1}\n", "!!opencv-matrix"),
            "a.yaml:1: a.b: has a tag, !!int; leave it out");
}

TEST(YamlNode, WithPutsValuesBesideAndInsteadOfItsOwn) {
  const YamlNode root = ParseYaml("a: 1\nb: {c: 2}\n", "a.yaml");
  const YamlNode more = ParseYaml("b: {d: 3}\ne: 4\n", "b.yaml");
  EXPECT_EQ(root.With(more.Entries()).OneLine(), "{a: 1, b: {d: 3}, e: 4}");
  EXPECT_EQ(root.OneLine(), "{a: 1, b: {c: 2}}");
}

}  // namespace
}  // namespace turbidock::config
