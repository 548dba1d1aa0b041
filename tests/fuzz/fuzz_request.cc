// Any bytes to the server of the live page, over a real socket: an answer of HTTP or none, and the
// page only for who names the secret. In the input SECRET stands for it, PORT for the server's.

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include "experiments/serve/access.h"
#include "experiments/serve/server.h"
#include "sim/base/check.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

namespace {

namespace asio = boost::asio;

constexpr std::string_view kPage = "<!doctype html><title>what only who knows the secret sees";

// Says back what it hears.
class Echo : public serve::Tab {
 public:
  std::optional<std::string> Next() override { return std::exchange(heard_, std::nullopt); }
  void OnMessage(std::string_view text) override {
    TD_CHECK(text.size() <= serve::Server::kMostMessageBytes, "no more than a tab may say");
    heard_ = text;
  }

 private:
  std::optional<std::string> heard_;
};

void Replace(std::string_view what, const std::string& with, std::string* text) {
  for (size_t at = 0; (at = text->find(what, at)) != std::string::npos; at += with.size())
    text->replace(at, what.size(), with);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static serve::Server server(
      {}, {[] { return std::string(kPage); }, [] { return std::make_unique<Echo>(); }});
  const std::string root = server.url().substr(server.url().find('/', 7));  // after http://
  const std::string secret = root.substr(1, root.size() - 2);
  const int port = std::stoi(server.url().substr(server.url().rfind(':') + 1));
  std::string request(reinterpret_cast<const char*>(data), size);
  Replace("SECRET", secret, &request);
  Replace("PORT", std::to_string(port), &request);
  serve::IsOwnHost(request, "127.0.0.1");
  TD_CHECK(!serve::IsOwnOrigin(request, "localhost") || request == "http://localhost", "ours");

  asio::io_context io;
  const asio::ip::tcp::endpoint there{asio::ip::make_address("127.0.0.1"),
                                      static_cast<uint16_t>(port)};
  asio::ip::tcp::socket socket(io);
  boost::system::error_code error, ignored;
  do {
    socket.close();
    socket.connect(there, error);
  } while (error == asio::error::interrupted);  // by libFuzzer's alarm
  TD_CHECK(!error, error.message());
  asio::write(socket, asio::buffer(request), ignored);
  socket.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
  std::string answer;
  asio::read(socket, asio::dynamic_buffer(answer), ignored);
  TD_CHECK(answer.empty() || answer.starts_with("HTTP/1.1 "), "an answer of HTTP");
  const bool is_page = answer.find(kPage) != std::string::npos;
  TD_CHECK(!is_page || request.find(secret) != std::string::npos, "the secret, or no page");
  return 0;
}
