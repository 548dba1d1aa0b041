#pragma once
// Bytes as text: RFC 4648, with padding.

#include <string>
#include <string_view>

namespace turbidock::system {

std::string Base64(std::string_view bytes);
// ConfigError for a text that is none.
std::string BytesOf(std::string_view base64);

}  // namespace turbidock::system
