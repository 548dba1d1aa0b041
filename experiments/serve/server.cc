#include "experiments/serve/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/lexical_cast.hpp>
#include <chrono>
#include <limits>
#include <list>
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
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kHeaderTime(2), kAnswerTime(10), kFarewellTime(2), kIdleTime(60);
constexpr uint32_t kMostHeaderBytes = 8192;
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
  response.set("Content-Security-Policy",
               "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
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
struct Server::Work {
  // A tab's WebSocket: reads all the time, writes whenever its tab has something and the last
  // message is out.
  struct Socket : std::enable_shared_from_this<Socket> {
    Socket(Work* owner, beast::tcp_stream stream)
        : work(*owner), socket(std::move(stream)), tab(owner->site.open_tab()) {
      ++work.tabs;
      work.sockets.insert(this);
    }
    ~Socket() {
      work.sockets.erase(this);
      --work.tabs;
    }

    void Start(const Request& request) {
      beast::get_lowest_layer(socket).expires_never();  // it has a clock of its own
      socket.set_option(websocket::stream_base::timeout{kAnswerTime, kIdleTime, true});
      socket.read_message_max(kMostMessageBytes);
      socket.binary(true);
      socket.auto_fragment(false);
      socket.async_accept(request, [self = shared_from_this()](error_code error) {
        if (error) return;
        self->writing = false;
        self->Read();
        self->Pump();
      });
    }

    // Sends what there is.
    void Pump() {
      if (writing) return;
      std::optional<std::string> next = tab->Next();
      if (!next) return;
      writing = true;
      message = std::move(*next);
      socket.async_write(asio::buffer(message),
                         [self = shared_from_this()](error_code error, size_t) {
                           self->writing = false;
                           if (!error) self->Pump();
                         });
    }

    void Drop() {
      beast::get_lowest_layer(socket).close();
      heard = Clock::time_point::max();
    }

    void Read() {
      socket.async_read(buffer, [self = shared_from_this()](error_code error, size_t) {
        if (error) return;  // the tab is gone, or talks too much
        self->heard = Clock::now();
        const auto data = self->buffer.cdata();
        self->tab->OnMessage({static_cast<const char*>(data.data()), data.size()});
        self->buffer.consume(self->buffer.size());
        self->Pump();
        self->Read();
      });
    }

    Work& work;
    websocket::stream<beast::tcp_stream, /*deflateSupported=*/false> socket;
    std::unique_ptr<Tab> tab;
    beast::flat_buffer buffer;
    std::string message;
    Clock::time_point heard = Clock::now();  // when it said something last
    bool writing = true;                     // or not accepted yet
  };

  // A request and its answer. Lives as long as something waits for it.
  struct Connection : std::enable_shared_from_this<Connection> {
    Connection(Work* owner, tcp::socket socket) : work(*owner), stream(std::move(socket)) {
      place = work.connections.insert(work.connections.end(), this);
    }
    ~Connection() { work.connections.erase(place); }

    void Start() {
      parser.header_limit(kMostHeaderBytes);
      parser.body_limit(std::numeric_limits<uint64_t>::max());  // none is read, whatever its size
      stream.expires_after(kHeaderTime);
      http::async_read_header(
          stream, buffer, parser, [self = shared_from_this()](error_code error, size_t) {
            if (error == http::error::header_limit)
              self->Send(Refusal(http::status::request_header_fields_too_large, "too long"));
            else if (!error)
              self->Respond();
          });
    }

    void Respond() {
      const Request& request = parser.get();
      const auto refuse = [&](http::status status, const char* why) { Send(Refusal(status, why)); };
      const std::string_view host = View(request[http::field::host]);
      if (request.count(http::field::host) != 1 || !IsOwnHost(host, work.address))
        return refuse(http::status::forbidden, "this host is not served");
      if (request.count(http::field::origin) > 0 &&
          !IsOwnOrigin(View(request[http::field::origin]), host))
        return refuse(http::status::forbidden, "pages of other origins are not served");
      if (parser.chunked() || parser.content_length().value_or(0) > 0)
        return refuse(http::status::payload_too_large, "no body is taken");
      if (request.method() != http::verb::get)
        return refuse(http::status::method_not_allowed, "only GET");

      const std::string_view target = View(request.target());
      const std::string root = "/" + work.secret + "/";
      const bool is_known = AreSame(target.substr(0, root.size()), root);
      if (is_known && target.size() == root.size()) return SendPage();
      if (is_known && target == root + "live" && work.site.open_tab &&
          websocket::is_upgrade(request))
        return work.OpenSocket(std::move(stream), request);
      refuse(http::status::not_found, "there is nothing here");
    }

    void SendPage() {
      try {
        Send(Answer(http::status::ok, work.site.page(), "text/html; charset=utf-8"));
      } catch (const std::exception& error) {  // of whoever makes it: the server goes on
        Send(Refusal(http::status::internal_server_error, error.what()));
      }
    }

    void Send(Response answer) {
      is_answered = true;
      response = std::move(answer);
      stream.expires_after(kAnswerTime);
      http::async_write(stream, response, [self = shared_from_this()](error_code error, size_t) {
        if (error) return;
        self->is_answered = false;
        error_code ignored;
        self->stream.socket().shutdown(tcp::socket::shutdown_send, ignored);
        self->stream.expires_after(kFarewellTime);
        self->SayFarewell();
      });
    }

    // Takes a little of what is still under way: closing at once would reset the connection, and
    // the answer could be lost.
    void SayFarewell() {
      buffer.clear();
      stream.async_read_some(buffer.prepare(kMostHeaderBytes),
                             [self = shared_from_this()](error_code error, size_t) {
                               if (!error) self->SayFarewell();
                             });
    }

    Work& work;
    std::list<Connection*>::iterator place;
    beast::tcp_stream stream;
    beast::flat_buffer buffer{2 * kMostHeaderBytes};
    http::request_parser<http::empty_body> parser;
    Response response;
    bool is_answered = false;  // right now
  };

  Work(const Endpoint& endpoint, Site the_site)
      : site(std::move(the_site)), address(endpoint.address), acceptor(io) {
    Listen(endpoint.port);
    Accept();
    thread = std::thread([this] { io.run(); });
  }
  ~Work() {
    io.stop();
    thread.join();
  }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  void Listen(int port) {
    error_code error;
    const auto parsed = asio::ip::make_address(address, error);
    if (error) throw ConfigError("--listen " + address, "is no address of this machine");
    try {
      acceptor = tcp::acceptor(io, {parsed, static_cast<uint16_t>(port)});
    } catch (const boost::system::system_error& failed) {
      const std::string where = fmt::format("{}:{}", address, port);
      if (failed.code() == asio::error::address_in_use)
        throw ConfigError(where + " is in use; give another --port, or 0 for any that is free");
      throw ConfigError(where + ": cannot listen there: " + failed.code().message());
    }
  }

  void Accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) Admit(std::move(socket));
      Accept();
    });
  }

  // Where there is no room, in place of the oldest; one that is being answered is the last to go.
  void Admit(tcp::socket socket) {
    if (connections.size() >= kMostRequests) {
      auto oldest = std::ranges::find_if_not(connections, &Connection::is_answered);
      if (oldest == connections.end()) oldest = connections.begin();
      (*oldest)->stream.close();
      connections.splice(connections.end(), connections, oldest);  // it goes a little later
    }
    std::make_shared<Connection>(this, std::move(socket))->Start();
  }

  // Where there is no room, in place of the one that has been silent longest: a page says all the
  // time what it has got.
  void OpenSocket(beast::tcp_stream stream, const Request& request) {
    if (sockets.size() >= kMostTabs)
      (*std::ranges::min_element(sockets, {}, &Socket::heard))->Drop();
    error_code ignored;
    stream.socket().set_option(tcp::no_delay(true), ignored);
    stream.socket().set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
    std::make_shared<Socket>(this, std::move(stream))->Start(request);
  }

  const std::string secret = NewSecret();
  const Site site;
  const std::string address;
  std::list<Connection*> connections;  // in the order in which they came
  std::set<Socket*> sockets;
  std::atomic<int> tabs = 0;  // sockets, for any thread
  asio::io_context io{1};     // what it holds refers to the above
  tcp::acceptor acceptor;
  std::thread thread;
};

Server::Server(const Endpoint& endpoint, Site site)
    : work_(std::make_unique<Work>(endpoint, std::move(site))) {
  url_ = fmt::format("http://{}/{}/",
                     boost::lexical_cast<std::string>(work_->acceptor.local_endpoint()),
                     work_->secret);
}

Server::~Server() = default;

int Server::tabs() const { return work_->tabs; }

void Server::Wake() {
  asio::post(work_->io, [work = work_.get()] {
    for (Work::Socket* const socket : work->sockets) socket->Pump();
  });
}

}  // namespace turbidock::serve
