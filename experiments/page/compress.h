#pragma once
// Data as they stand in a page.

#include <string>
#include <string_view>

namespace turbidock::page {

// RFC 1952, the smallest that zlib makes: what a browser's DecompressionStream("gzip") reads. The
// same bytes for the same text.
std::string Gzip(std::string_view text);

// RFC 4648, with padding.
std::string Base64(std::string_view bytes);

// Text as it may stand in HTML between tags and in attributes with double quotes.
std::string EscapeHtml(std::string_view text);

}  // namespace turbidock::page
