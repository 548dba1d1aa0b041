#pragma once
// How a message to a tab is put together.

#include <string>

#include "experiments/report/json.h"

namespace turbidock::live {

// The length of the head (4 bytes, least significant first), the head, then the left and the right
// picture.
inline std::string Framed(const report::Json& head, const std::string& left = "",
                          const std::string& right = "") {
  const std::string text = report::JsonLine(head);
  std::string message;
  message.reserve(4 + text.size() + left.size() + right.size());
  for (int shift = 0; shift < 32; shift += 8)
    message += static_cast<char>(text.size() >> shift & 0xff);
  return message.append(text).append(left).append(right);
}

}  // namespace turbidock::live
