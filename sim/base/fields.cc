#include "sim/base/fields.h"

#include <charconv>

namespace turbidock {

std::string FormatNumber(double x) {
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, x);
  return std::string(buffer, result.ptr);
}

std::string Dotted(const std::string& group, const std::string& key) {
  return group.empty() ? key : group + "." + key;
}

std::string Range::Sentence() const {
  const bool has_low = std::isfinite(low), has_high = std::isfinite(high);
  if (has_low && has_high)
    return std::string("must be in ") + (low_open ? "(" : "[") + FormatNumber(low) + ", " +
           FormatNumber(high) + (high_open ? ")" : "]");
  if (has_low) return std::string("must be ") + (low_open ? "> " : ">= ") + FormatNumber(low);
  if (has_high) return std::string("must be ") + (high_open ? "< " : "<= ") + FormatNumber(high);
  return "must be finite";
}

}  // namespace turbidock
