#pragma once
// Who may talk to a server of this program: whoever knows its secret, from a page of its own.

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <random>
#include <string>
#include <string_view>

namespace turbidock::serve {

// 128 random bits as 32 hexadecimal digits.
inline std::string NewSecret() {
  std::random_device device;  // the kernel's generator
  std::string secret;
  for (int i = 0; i < 4; ++i) secret += fmt::format("{:08x}", device());
  return secret;
}

// Whether two texts are equal, in a time that does not tell where they differ.
inline bool AreSame(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

// Whether a Host header ("localhost:8137") is how a browser may address a server that listens at
// `address`. Only a name can be made to point here by a stranger (DNS rebinding), so of all names
// only localhost is; and addresses: the loopback ones, any of them where it does not listen on
// loopback. The port may be that of a tunnel.
inline bool IsOwnHost(std::string_view host, std::string_view address) {
  // a name, or an IPv6 address in brackets, and perhaps a port
  const size_t bracket = host.starts_with('[') ? 1 : 0;
  const size_t end = std::min(host.find(bracket == 1 ? ']' : ':'), host.size());
  const std::string name(host.substr(bracket, end - bracket));
  const std::string_view port = host.substr(std::min(end + bracket, host.size()));
  const bool is_port = port.size() >= 2 && port.size() <= 6 && port[0] == ':' &&
                       port.find_first_not_of("0123456789", 1) == std::string_view::npos;
  if (name.empty() || end + bracket > host.size() || !(port.empty() || is_port)) return false;
  if (name == "localhost") return true;
  boost::system::error_code none, other;
  const auto literal = boost::asio::ip::make_address(name, none),
             own = boost::asio::ip::make_address(std::string(address), other);
  return !none && (literal.is_loopback() || !own.is_loopback());
}

// Whether an Origin header is that of a page that came from this host over HTTP.
inline bool IsOwnOrigin(std::string_view origin, std::string_view host) {
  return origin == fmt::format("http://{}", host);
}

}  // namespace turbidock::serve
