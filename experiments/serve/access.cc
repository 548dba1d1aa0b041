#include "experiments/serve/access.h"

#include <fmt/format.h>

#include <boost/asio/ip/address.hpp>
#include <optional>
#include <random>

namespace turbidock::serve {
namespace {

namespace ip = boost::asio::ip;

std::optional<ip::address> AddressOf(std::string_view text) {
  boost::system::error_code error;
  const ip::address address = ip::make_address(std::string(text), error);
  return error ? std::nullopt : std::optional(address);
}

// A Host header without its port and, of an IPv6 address, its brackets. Nothing: no valid header.
std::optional<std::string_view> NameIn(std::string_view host) {
  const bool bracketed = host.starts_with('[');
  const size_t end = bracketed ? host.find(']') : host.find(':');
  if (bracketed && end == std::string_view::npos) return std::nullopt;
  const std::string_view name = host.substr(bracketed ? 1 : 0, end - (bracketed ? 1 : 0));
  const std::string_view rest =
      end == std::string_view::npos ? "" : host.substr(end + (bracketed ? 1 : 0));
  const bool is_port = rest.empty() || (rest.size() >= 2 && rest.size() <= 6 && rest[0] == ':' &&
                                        rest.find_first_not_of("0123456789", 1) == rest.npos);
  if (name.empty() || !is_port) return std::nullopt;
  return name;
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

bool IsLoopback(std::string_view address) {
  const auto parsed = AddressOf(address);
  return parsed && parsed->is_loopback();
}

bool IsOwnHost(std::string_view host, std::string_view address) {
  const auto name = NameIn(host);
  if (!name) return false;
  if (*name == "localhost") return true;
  const auto literal = AddressOf(*name);
  return literal && (literal->is_loopback() || !IsLoopback(address));
}

bool IsOwnOrigin(std::string_view origin, std::string_view host) {
  constexpr std::string_view kScheme = "http://";
  return origin.starts_with(kScheme) && origin.substr(kScheme.size()) == host;
}

}  // namespace turbidock::serve
