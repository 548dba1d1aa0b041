#include "experiments/system/plain_text.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <boost/algorithm/string/split.hpp>
#include <boost/locale/utf.hpp>
#include <vector>

namespace turbidock::system {
namespace {

bool IsControl(unsigned char c) {
  return (c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7f;
}

// Bytes of the UTF-8 letter that the text begins with; 0 if it begins with none.
size_t LetterAt(std::string_view text) {
  const char* next = text.data();
  const auto letter = boost::locale::utf::utf_traits<char>::decode(next, text.data() + text.size());
  return letter > 0x10ffff ? 0 : static_cast<size_t>(next - text.data());
}

// Where the letter begins that the byte at `i` is part of.
size_t LetterBegin(const std::string& text, size_t i) {
  while (i > 0 && (static_cast<unsigned char>(text[i]) & 0xc0U) == 0x80) --i;
  return i;
}

// With dots for the middle of what has more than `most` bytes.
std::string WithoutMiddle(const std::string& text, size_t most) {
  if (text.size() <= most) return text;
  return text.substr(0, LetterBegin(text, most / 2)) + "..." +
         text.substr(LetterBegin(text, text.size() - most / 2));
}

}  // namespace

std::optional<size_t> FirstNoText(std::string_view text) {
  for (size_t i = 0; i < text.size();) {
    const size_t length = LetterAt(text.substr(i));
    // DEL is no control character of YAML's
    if (length == 0 || (text[i] != 0x7f && IsControl(static_cast<unsigned char>(text[i]))))
      return i;
    i += length;
  }
  return std::nullopt;
}

std::string Printable(std::string_view text) {
  std::string out;
  const auto byte = [&](size_t at) { return static_cast<unsigned char>(text[at]); };
  for (size_t i = 0; i < text.size();) {
    size_t length = LetterAt(text.substr(i));
    // C1 controls are two bytes, c2 80 to c2 9f
    const bool is_c1 = length == 2 && byte(i) == 0xc2 && byte(i + 1) < 0xa0;
    if (length > 0 && !is_c1 && !(length == 1 && IsControl(byte(i)))) {
      out += text.substr(i, length);
      i += length;
      continue;
    }
    for (length = is_c1 ? 2 : 1; length > 0; --length) out += fmt::format("\\x{:02x}", byte(i++));
  }
  return out;
}

std::string OneLineOf(std::string_view text) {
  constexpr size_t kLongestWord = 200, kLongestLine = 2000;
  std::string plain = Printable(text);
  std::erase(plain, '\r');
  plain.resize(plain.find_last_not_of(" \t\n") + 1);  // to nothing where there is nothing else
  std::vector<std::string> words;
  boost::split(words, plain, [](char c) { return c == ' ' || c == '\n'; });
  for (std::string& word : words) word = WithoutMiddle(word, kLongestWord);
  return WithoutMiddle(fmt::format("{}", fmt::join(words, " ")), kLongestLine);
}

std::string Shortened(const std::string& text) {
  constexpr size_t kLongest = 60;
  const std::string plain = Printable(text);
  return plain.size() <= kLongest ? plain : plain.substr(0, LetterBegin(plain, kLongest)) + "...";
}

std::string ShellWord(const std::string& text) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./:=,@%+";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  return "'" + boost::replace_all_copy(text, "'", "'\\''") + "'";
}

std::string Indented(const std::string& lines, const std::string& by) {
  return by + boost::replace_all_copy(lines.substr(0, lines.size() - 1), "\n", "\n" + by) + "\n";
}

}  // namespace turbidock::system
