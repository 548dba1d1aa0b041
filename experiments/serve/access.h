#pragma once
// Who may talk to a server of this program: whoever knows its secret, from a page of its own.

#include <string>
#include <string_view>

namespace turbidock::serve {

// 128 random bits as 32 hexadecimal digits.
std::string NewSecret();

// Whether two texts are equal, in a time that does not tell where they differ.
bool AreSame(std::string_view a, std::string_view b);

// Whether a Host header ("localhost:8137") is how a browser may address a server that listens at
// `address`. Only a name can be made to point here by a stranger (DNS rebinding), so of all names
// only localhost is; and addresses: the loopback ones, any of them where it does not listen on
// loopback. The port may be that of a tunnel.
bool IsOwnHost(std::string_view host, std::string_view address);

// Whether an Origin header is that of a page that came from this host over HTTP.
bool IsOwnOrigin(std::string_view origin, std::string_view host);

}  // namespace turbidock::serve
