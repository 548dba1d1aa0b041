// What gets in and what does not, over real sockets.

#include "experiments/serve/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sim/base/check.h"
#include "tests/support/message_of.h"

namespace turbidock::serve {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
namespace asio = boost::asio;
namespace beast = boost::beast;
using tcp = asio::ip::tcp;
using WebSocket = beast::websocket::stream<tcp::socket>;

const std::string kPage = "<!doctype html><title>the page</title>";

// Counts up to what Release allows, and says back what it hears.
struct Counter {
  std::atomic<int> allowed = 0, open = 0;
  std::mutex mutex;
  std::vector<std::string> heard;

  struct CountingTab : Tab {
    explicit CountingTab(Counter* owner) : counter(*owner) { ++counter.open; }
    ~CountingTab() override { --counter.open; }
    std::optional<std::string> Next() override {
      if (sent >= counter.allowed) return std::nullopt;
      return std::to_string(++sent);
    }
    void OnMessage(std::string_view text) override {
      const std::lock_guard lock(counter.mutex);
      counter.heard.emplace_back(text);
    }
    Counter& counter;
    int sent = 0;
  };
  Site site() {
    return {[] { return kPage; }, [this] { return std::make_unique<CountingTab>(this); }};
  }
};

int PortOf(const Server& server) {
  return std::stoi(server.url().substr(server.url().rfind(':') + 1));
}

class Client {
 public:
  explicit Client(int port) : port_(port) {}

  tcp::socket Connect() {
    tcp::socket socket(io_);
    socket.connect({asio::ip::make_address("127.0.0.1"), static_cast<uint16_t>(port_)});
    return socket;
  }
  // What comes back for these bytes until the server closes.
  std::string Ask(const std::string& request) {
    tcp::socket socket = Connect();
    boost::system::error_code ignored;
    asio::write(socket, asio::buffer(request), ignored);
    std::string answer;
    asio::read(socket, asio::dynamic_buffer(answer), ignored);
    return answer;
  }
  std::string Get(const std::string& path, const std::string& headers = "") {
    return Ask("GET " + path + " HTTP/1.1\r\nHost: " + host() + "\r\n" + headers + "\r\n");
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  WebSocket Open(const std::string& path) {
    WebSocket socket(Connect());
    socket.handshake(host(), path);
    return socket;
  }

 private:
  asio::io_context io_;
  int port_;
};

std::string Read(WebSocket* socket) {
  beast::flat_buffer buffer;
  socket->read(buffer);
  return beast::buffers_to_string(buffer.data());
}

template <class Condition>
bool Soon(const Condition& condition) {
  for (int i = 0; i < 500 && !condition(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return condition();
}

class ServerTest : public ::testing::Test {
 protected:
  // "/SECRET/"
  std::string root() const { return server_.url().substr(server_.url().find('/', 8)); }

  Counter counter_;
  Server server_{{}, counter_.site()};
  Client client_{PortOf(server_)};
};

TEST_F(ServerTest, GivesThePageToWhoKnowsTheSecretOnly) {
  const std::string answer = client_.Get(root());
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(answer, ::testing::EndsWith("\r\n\r\n" + kPage));
  for (const char* header :
       {"Content-Security-Policy: default-src 'none'", "X-Content-Type-Options: nosniff",
        "Referrer-Policy: no-referrer", "Cache-Control: no-store"})
    EXPECT_THAT(answer, HasSubstr(header));

  std::string other = root();
  other[1] = other[1] == 'a' ? 'b' : 'a';
  for (const std::string& path : std::vector<std::string>{
           "/", "/favicon.ico", other, root() + "x", root() + "../", root() + "../../etc/passwd",
           root() + "..%2f..%2fetc/passwd", "/../../../../etc/passwd", "//etc/passwd",
           root().substr(0, root().size() - 1), "http://evil.example" + root(), root() + "live"}) {
    const std::string refused = client_.Get(path);
    EXPECT_THAT(refused, StartsWith("HTTP/1.1 404 ")) << path;
    EXPECT_THAT(refused, ::testing::Not(HasSubstr("root:"))) << path;
  }
}

TEST_F(ServerTest, RefusesForeignHostsAndOrigins) {
  const auto get = [&](const std::string& headers) {
    return client_.Ask("GET " + root() + " HTTP/1.1\r\n" + headers + "\r\n");
  };
  for (const std::string& headers :
       std::vector<std::string>{"", "Host: evil.example\r\n",
                                "Host: evil.example:" + std::to_string(PortOf(server_)) + "\r\n",
                                "Host: " + client_.host() + "\r\nHost: evil.example\r\n",
                                "Host: " + client_.host() + "\r\nOrigin: http://evil.example\r\n",
                                "Host: " + client_.host() + "\r\nOrigin: null\r\n"})
    EXPECT_THAT(get(headers), StartsWith("HTTP/1.1 403 ")) << headers;
  // a tunnel's other end
  EXPECT_THAT(get("Host: localhost:9999\r\nOrigin: http://localhost:9999\r\n"),
              StartsWith("HTTP/1.1 200 "));
}

TEST_F(ServerTest, TakesNoBodyAndNoOtherMethod) {
  const std::string head = root() + " HTTP/1.1\r\nHost: " + client_.host() + "\r\n";
  EXPECT_THAT(client_.Ask("POST " + head + "\r\n"), StartsWith("HTTP/1.1 405 "));
  EXPECT_THAT(client_.Ask("BREW " + head + "\r\n"), StartsWith("HTTP/1.1 4"));
  EXPECT_THAT(
      client_.Ask("POST " + head + "Content-Length: 100000000\r\n\r\n" + std::string(100'000, 'x')),
      StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(client_.Ask("POST " + head + "Transfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n"),
              StartsWith("HTTP/1.1 413 "));
  // a hundred megabytes, sent whatever the server says
  std::string flood = "POST " + head + "Content-Length: 100000000\r\n\r\n";
  flood.append(100'000'000, 'x');
  client_.Ask(flood);
  EXPECT_THAT(client_.Get(root(), "X: " + std::string(20'000, 'x') + "\r\n"),
              StartsWith("HTTP/1.1 431 "));
  client_.Ask("\x16\x03\x01 this is not HTTP\r\n\r\n");
  EXPECT_THAT(client_.Get(root()), StartsWith("HTTP/1.1 200 "));
}

TEST_F(ServerTest, SurvivesAThousandAtOnce) {
  std::vector<std::thread> crowd;
  std::atomic<int> served = 0, refused = 0;
  for (int i = 0; i < 20; ++i)
    crowd.emplace_back([&] {
      Client client(PortOf(server_));
      for (int k = 0; k < 50; ++k) {
        try {
          const std::string answer = client.Get(root());
          ++(answer.starts_with("HTTP/1.1 200 ") ? served : refused);
        } catch (const boost::system::system_error&) {
          ++refused;
        }
      }
    });
  for (std::thread& one : crowd) one.join();
  EXPECT_EQ(served + refused, 1000);
  EXPECT_TRUE(Soon([&] { return client_.Get(root()).starts_with("HTTP/1.1 200 "); }));
}

TEST_F(ServerTest, HalfRequestsKeepNoPageOut) {
  std::vector<tcp::socket> half;
  for (int i = 0; i < 200; ++i) {
    half.push_back(client_.Connect());
    asio::write(half.back(), asio::buffer("GET " + root() + " HTTP/1.1\r\nHost: 127"));
  }
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(client_.Get(root()), StartsWith("HTTP/1.1 200 "));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
  // and none is waited for longer than 2 s
  boost::system::error_code error;
  char byte;
  half.back().read_some(asio::buffer(&byte, 1), error);
  EXPECT_EQ(error, asio::error::eof);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST_F(ServerTest, SilentTabsKeepNoTabOut) {
  WebSocket page = client_.Open(root() + "live");
  std::vector<WebSocket> silent;
  for (int i = 0; i < 63; ++i) {
    silent.push_back(client_.Open(root() + "live"));
    page.write(asio::buffer(std::string("got")));
    EXPECT_TRUE(Soon([&] {
      const std::lock_guard lock(counter_.mutex);
      return std::ssize(counter_.heard) == i + 1;
    }));
  }
  EXPECT_TRUE(Soon([&] { return server_.tabs() == static_cast<int>(Server::kMostTabs); }));
  WebSocket second = client_.Open(root() + "live");
  counter_.allowed = 1;
  server_.Wake();
  for (WebSocket* tab : {&page, &second, &silent.back()}) EXPECT_EQ(Read(tab), "1");
  beast::flat_buffer buffer;
  boost::system::error_code error;
  silent.front().read(buffer, error);
  EXPECT_TRUE(error) << "the one silent longest was closed";
}

TEST_F(ServerTest, ATabGetsWhatIsNewAndIsHeard) {
  WebSocket first = client_.Open(root() + "live"), second = client_.Open(root() + "live");
  EXPECT_TRUE(Soon([&] { return server_.tabs() == 2; }));
  counter_.allowed = 3;
  server_.Wake();
  for (WebSocket* tab : {&first, &second})
    for (const char* message : {"1", "2", "3"}) EXPECT_EQ(Read(tab), message);
  first.write(asio::buffer(std::string("hello")));
  EXPECT_TRUE(Soon([&] {
    const std::lock_guard lock(counter_.mutex);
    return counter_.heard == std::vector<std::string>{"hello"};
  }));
  // one goes without a word
  second.next_layer().close();
  EXPECT_TRUE(Soon([&] { return server_.tabs() == 1 && counter_.open == 1; }));
  counter_.allowed = 4;
  server_.Wake();
  EXPECT_EQ(Read(&first), "4");
}

TEST_F(ServerTest, ATabThatSaysTooMuchIsClosed) {
  WebSocket tab = client_.Open(root() + "live");
  boost::system::error_code ignored;
  tab.write(asio::buffer(std::string(Server::kMostMessageBytes + 1, 'x')), ignored);
  beast::flat_buffer buffer;
  boost::system::error_code closed;
  tab.read(buffer, closed);
  EXPECT_EQ(closed, beast::websocket::error::closed);
  EXPECT_TRUE(Soon([&] { return counter_.open == 0; }));
  EXPECT_TRUE(counter_.heard.empty());
}

TEST_F(ServerTest, SocketsOfOtherPagesAreRefused) {
  WebSocket tab(client_.Connect());
  tab.set_option(
      beast::websocket::stream_base::decorator([](beast::websocket::request_type& request) {
        request.set(beast::http::field::origin, "http://evil.example");
      }));
  boost::system::error_code error;
  tab.handshake(client_.host(), root() + "live", error);
  EXPECT_EQ(error, beast::websocket::error::upgrade_declined);
  EXPECT_EQ(counter_.open, 0);
}

TEST(Server, SaysWhenItCannotListen) {
  Counter counter;
  const Server server({}, counter.site());
  const auto message = [&](const Endpoint& endpoint) {
    return testing::MessageOf([&] { const Server other(endpoint, counter.site()); });
  };
  EXPECT_EQ(message({.port = PortOf(server)}),
            "127.0.0.1:" + std::to_string(PortOf(server)) +
                " is in use; give another --port, or 0 for any that is free");
  EXPECT_THAT(message({.address = "nowhere"}), HasSubstr("is no address"));
  EXPECT_THAT(message({.address = "203.0.113.7"}), HasSubstr("cannot listen there"));
}

TEST(Server, APageMayHaveNoSocketsAndMayFail) {
  int asked = 0;
  const Server server({}, {.page = [&]() -> std::string {
                             if (++asked == 2) throw ConfigError("sweep.db: is <gone>");
                             if (asked == 3) throw std::runtime_error("of a library");
                             return "first";
                           },
                           .open_tab = {}});
  Client client(PortOf(server));
  const std::string root = server.url().substr(server.url().find('/', 8));
  EXPECT_THAT(client.Get(root), ::testing::EndsWith("first"));
  const std::string failed = client.Get(root);
  EXPECT_THAT(failed, StartsWith("HTTP/1.1 500 "));
  EXPECT_THAT(failed, HasSubstr("Content-Type: text/plain"));
  EXPECT_THAT(failed, ::testing::EndsWith("sweep.db: is <gone>\n"));
  EXPECT_THAT(client.Get(root), ::testing::EndsWith("of a library\n"));
  WebSocket tab(client.Connect());
  boost::system::error_code error;
  tab.handshake(client.host(), root + "live", error);
  EXPECT_EQ(error, beast::websocket::error::upgrade_declined);
}

TEST(Server, EndsWithTabsOpen) {
  Counter counter;
  auto server = std::make_unique<Server>(Endpoint{}, counter.site());
  Client client(PortOf(*server));
  WebSocket tab = client.Open(server->url().substr(server->url().find('/', 8)) + "live");
  tcp::socket silent = client.Connect();
  EXPECT_TRUE(Soon([&] { return counter.open == 1; }));
  server.reset();
  EXPECT_EQ(counter.open, 0);
}

}  // namespace
}  // namespace turbidock::serve
