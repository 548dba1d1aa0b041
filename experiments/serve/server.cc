#include "experiments/serve/server.h"

#include <fmt/format.h>

#include <atomic>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <limits>
#include <set>
#include <thread>
#include <utility>

#include "experiments/serve/access.h"
#include "sim/base/check.h"

namespace turbidock::serve {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using tcp = asio::ip::tcp;

constexpr std::chrono::seconds kRequestTime(10), kFarewellTime(2), kIdleTime(60);
constexpr uint32_t kMostHeaderBytes = 8192;
constexpr size_t kFarewellBytes = 256 * 1024;
// Of what is on its way to a tab: little, so that what it sees is recent.
constexpr int kSendBufferBytes = 256 * 1024;

using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

std::string_view View(beast::string_view text) { return {text.data(), text.size()}; }

Response Answer(http::status status, std::string body, const char* type) {
  Response response(status, 11);
  response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  // The page has everything in it and talks to nobody but this server.
  response.set(
      "Content-Security-Policy",
      "default-src 'none'; script-src 'unsafe-inline' data: blob:; style-src 'unsafe-inline'; "
      "img-src data: blob:; media-src data: blob:; connect-src 'self'; "
      "base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
  response.keep_alive(false);
  response.body() = std::move(body);
  response.prepare_payload();
  return response;
}

Response Refusal(http::status status, const std::string& why) {
  return Answer(status, why + "\n", "text/plain; charset=utf-8");
}

}  // namespace

// Everything that happens in the server's thread.
class Server::Work {
 public:
  Work(const Place& place, Site site)
      : site_(std::move(site)), address_(place.address), acceptor_(io_), retry_(io_) {
    Listen(place);
    Accept();
    thread_ = std::thread([this] { io_.run(); });
  }
  ~Work() {
    io_.stop();
    thread_.join();
  }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  const std::string& secret() const { return secret_; }
  int port() const { return acceptor_.local_endpoint().port(); }
  int tabs() const { return open_tabs_; }

  void Wake();

 private:
  class Connection;
  class Socket;

  void Listen(const Place& place);
  void Accept();

  const std::string secret_ = NewSecret();
  Site site_;
  std::string address_;
  std::atomic<int> open_tabs_ = 0;
  std::atomic<bool> waking_ = false;
  int connections_ = 0;
  std::set<Socket*> sockets_;
  asio::io_context io_{1};  // what it holds refers to the above
  tcp::acceptor acceptor_;
  asio::steady_timer retry_;
  std::thread thread_;
};

// A request and its answer. Lives as long as something waits for it.
class Server::Work::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Work* work, tcp::socket socket) : work_(*work), stream_(std::move(socket)) {
    ++work_.connections_;
  }
  ~Connection() { --work_.connections_; }

  void Start() {
    parser_.header_limit(kMostHeaderBytes);
    parser_.body_limit(std::numeric_limits<uint64_t>::max());  // none is read, whatever its size
    stream_.expires_after(kRequestTime);
    http::async_read_header(
        stream_, buffer_, parser_, [self = shared_from_this()](error_code error, size_t) {
          if (error == http::error::header_limit)
            self->Send(Refusal(http::status::request_header_fields_too_large, "too long"));
          else if (!error)
            self->Respond();
        });
  }

 private:
  void Respond();
  void SendPage();
  void Open();
  void Send(Response response);
  void SayFarewell();

  Work& work_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{2 * kMostHeaderBytes};
  http::request_parser<http::empty_body> parser_;
  Response response_;
  size_t drained_ = 0;
};

// A tab's WebSocket: reads all the time, writes whenever its tab has something and the last message
// is out.
class Server::Work::Socket : public std::enable_shared_from_this<Socket> {
 public:
  Socket(Work* work, beast::tcp_stream stream, std::unique_ptr<Tab> tab)
      : work_(*work), socket_(std::move(stream)), tab_(std::move(tab)) {
    ++work_.connections_;
    ++work_.open_tabs_;
    work_.sockets_.insert(this);
  }
  ~Socket() {
    work_.sockets_.erase(this);
    --work_.open_tabs_;
    --work_.connections_;
  }

  void Start(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();  // it has a clock of its own
    socket_.set_option(websocket::stream_base::timeout{kRequestTime, kIdleTime, true});
    socket_.read_message_max(kMostMessageBytes);
    socket_.binary(true);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->accepted_ = true;
      self->Read();
      self->Pump();
    });
  }

  // Sends what there is.
  void Pump() {
    if (writing_ || !accepted_) return;
    std::optional<std::string> message = tab_->Next();
    if (!message) return;
    writing_ = true;
    message_ = std::move(*message);
    socket_.async_write(asio::buffer(message_),
                        [self = shared_from_this()](error_code error, size_t) {
                          self->writing_ = false;
                          if (!error) self->Pump();
                        });
  }

 private:
  void Read() {
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, size_t) {
      if (error) return;  // the tab is gone, or talks too much
      const auto data = self->buffer_.cdata();
      self->tab_->Hear({static_cast<const char*>(data.data()), data.size()});
      self->buffer_.consume(self->buffer_.size());
      self->Pump();
      self->Read();
    });
  }

  Work& work_;
  websocket::stream<beast::tcp_stream> socket_;
  std::unique_ptr<Tab> tab_;
  beast::flat_buffer buffer_;
  std::string message_;
  bool accepted_ = false, writing_ = false;
};

void Server::Work::Connection::Respond() {
  const Request& request = parser_.get();
  const auto refuse = [&](http::status status, const char* why) { Send(Refusal(status, why)); };
  const std::string_view host = View(request[http::field::host]);
  if (request.count(http::field::host) != 1 || !IsOwnHost(host, work_.address_))
    return refuse(http::status::forbidden, "this host is not served");
  if (request.count(http::field::origin) > 0 &&
      !IsOwnOrigin(View(request[http::field::origin]), host))
    return refuse(http::status::forbidden, "pages of other origins are not served");
  if (parser_.chunked() || parser_.content_length().value_or(0) > 0)
    return refuse(http::status::payload_too_large, "no body is taken");
  if (request.method() != http::verb::get)
    return refuse(http::status::method_not_allowed, "only GET");

  const std::string_view target = View(request.target());
  const std::string root = "/" + work_.secret_ + "/";
  constexpr std::string_view kLive = "live";
  if (target.size() < root.size() || !AreSame(target.substr(0, root.size()), root))
    return refuse(http::status::not_found, "there is nothing here");
  const std::string_view path = target.substr(root.size());
  if (path.empty()) return SendPage();
  if (path == kLive && work_.site_.open_tab && websocket::is_upgrade(request)) return Open();
  refuse(http::status::not_found, "there is nothing here");
}

void Server::Work::Connection::SendPage() {
  try {
    Send(Answer(http::status::ok, work_.site_.page(), "text/html; charset=utf-8"));
  } catch (const std::exception& error) {  // of whoever makes it: the server goes on
    Send(Refusal(http::status::internal_server_error, error.what()));
  }
}

void Server::Work::Connection::Open() {
  error_code ignored;
  stream_.socket().set_option(tcp::no_delay(true), ignored);
  stream_.socket().set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
  std::make_shared<Socket>(&work_, std::move(stream_), work_.site_.open_tab())
      ->Start(parser_.get());
}

void Server::Work::Connection::Send(Response response) {
  response_ = std::move(response);
  stream_.expires_after(kRequestTime);
  http::async_write(stream_, response_, [self = shared_from_this()](error_code error, size_t) {
    if (error) return;
    error_code ignored;
    self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    self->stream_.expires_after(kFarewellTime);
    self->SayFarewell();
  });
}

// Takes a little of what is still under way: closing at once would reset the connection, and the
// answer could be lost.
void Server::Work::Connection::SayFarewell() {
  buffer_.clear();
  stream_.async_read_some(buffer_.prepare(kMostHeaderBytes),
                          [self = shared_from_this()](error_code error, size_t count) {
                            self->drained_ += count;
                            if (!error && self->drained_ < kFarewellBytes) self->SayFarewell();
                          });
}

void Server::Work::Listen(const Place& place) {
  const std::string where = fmt::format("{}:{}", place.address, place.port);
  error_code error;
  const auto address = asio::ip::make_address(place.address, error);
  if (error) throw ConfigError("--listen " + place.address, "is no address of this machine");
  const tcp::endpoint endpoint(address, static_cast<uint16_t>(place.port));
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use)
    throw ConfigError(where + " is in use; give another --port, or 0 for any that is free");
  if (error) throw ConfigError(where + ": cannot listen there: " + error.message());
}

void Server::Work::Accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) {  // out of descriptors, for instance: not for ever
      retry_.expires_after(std::chrono::milliseconds(100));
      retry_.async_wait([this](error_code) { Accept(); });
      return;
    }
    if (connections_ < kMostConnections) {
      std::make_shared<Connection>(this, std::move(socket))->Start();
    } else {
      static constexpr std::string_view kFull =
          "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
      error_code ignored;
      socket.non_blocking(true, ignored);
      socket.write_some(asio::buffer(kFull), ignored);
    }
    Accept();
  });
}

void Server::Work::Wake() {
  if (waking_.exchange(true)) return;
  asio::post(io_, [this] {
    waking_ = false;
    for (Socket* const socket : std::set(sockets_)) socket->Pump();
  });
}

Server::Server(const Place& place, Site site)
    : work_(std::make_unique<Work>(place, std::move(site))), port_(work_->port()) {
  const bool is_v6 = place.address.find(':') != std::string::npos;
  url_ = fmt::format("http://{}{}{}:{}/{}/", is_v6 ? "[" : "", place.address, is_v6 ? "]" : "",
                     port_, work_->secret());
}

Server::~Server() = default;

int Server::tabs() const { return work_->tabs(); }

void Server::Wake() { work_->Wake(); }

}  // namespace turbidock::serve
