#pragma once
// Text that people can read: what is taken from files and what is printed.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace turbidock::system {

// Where a text has its first byte that is no UTF-8, or a control character below the space other
// than tab and line breaks; nothing if it has none.
std::optional<size_t> FirstNoText(std::string_view text);

// The text as it is safe on a terminal: whatever is no text as above, and every further control
// character, is written as \xNN.
std::string Printable(std::string_view text);
// The same as one line of a message: a line break is a space, and dots stand for the middle of a
// word of more than 200 bytes (somebody's data) and of a line of more than 2000.
std::string OneLineOf(std::string_view text);

// The first 60 bytes of what a user wrote, Printable, no letter of it cut, and dots where there is
// more.
std::string Shortened(const std::string& text);

// A word of a command as a shell reads it back: in quotes where it needs them.
std::string ShellWord(const std::string& text);

// Whole lines with `by` before each, as a block of YAML has them.
std::string Indented(const std::string& lines, const std::string& by);

}  // namespace turbidock::system
