#include "experiments/system/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace turbidock::system {
namespace {

bool IsControl(unsigned char c) {
  return (c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7f;
}

// Bytes of the UTF-8 letter that the text begins with; 0 if it begins with none.
size_t LetterAt(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
  uint32_t letter = first & (0xffU >> (length + 1));
  for (size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return 0;
    letter = letter << 6U | (byte(i) & 0x3fU);
  }
  const bool too_long = (length == 3 && letter < 0x800) || (length == 4 && letter < 0x10000);
  const bool surrogate = letter >= 0xd800 && letter < 0xe000;
  return too_long || surrogate || letter > 0x10ffff ? 0 : length;
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
  std::string line;
  for (size_t begin = 0; begin < plain.size();) {
    const size_t end = std::min(plain.find_first_of(" \n", begin), plain.size());
    line += WithoutMiddle(plain.substr(begin, end - begin), kLongestWord);
    if (end < plain.size()) line += ' ';
    begin = end + 1;
  }
  return WithoutMiddle(line, kLongestLine);
}

std::string Shortened(const std::string& text) {
  constexpr size_t kLongest = 60;
  const std::string plain = Printable(text);
  return plain.size() <= kLongest ? plain : plain.substr(0, LetterBegin(plain, kLongest)) + "...";
}

std::string Indented(const std::string& text, const std::string& by) {
  std::string out;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    out += by + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return out;
}

}  // namespace turbidock::system
