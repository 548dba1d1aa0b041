#include "experiments/serve/access.h"

#include <fmt/format.h>

#include <boost/asio/ip/address.hpp>
#include <optional>
#include <random>
#include <regex>
#include <string>

namespace turbidock::serve {
namespace {

using boost::asio::ip::address;

std::optional<address> AddressOf(std::string_view text) {
  boost::system::error_code error;
  const address parsed = boost::asio::ip::make_address(std::string(text), error);
  return error ? std::nullopt : std::optional(parsed);
}

}  // namespace

std::string NewSecret() {
  std::random_device device;  // the kernel's generator
  std::string secret;
  for (int i = 0; i < 4; ++i) secret += fmt::format("{:08x}", device());
  return secret;
}

bool AreSame(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

bool IsOwnHost(std::string_view host, std::string_view address) {
  // a name, or an IPv6 address in brackets, and perhaps a port
  static const std::regex form(R"((\[([^\]]+)\]|([^:]+))(:[0-9]{1,5})?)");
  constexpr size_t kLongest = 300;  // of a name, and a bound for the expression's work
  std::cmatch match;
  if (host.size() > kLongest || !std::regex_match(host.begin(), host.end(), match, form))
    return false;
  const std::string name = match[2].matched ? match[2] : match[3];
  if (name == "localhost") return true;
  const auto literal = AddressOf(name), own = AddressOf(address);
  return literal && (literal->is_loopback() || !(own && own->is_loopback()));
}

bool IsOwnOrigin(std::string_view origin, std::string_view host) {
  return origin == fmt::format("http://{}", host);
}

}  // namespace turbidock::serve
