// A trial served to tabs, over real sockets and without a browser.

#include "experiments/studies/live/live_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <future>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/system/base64.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial.h"

namespace turbidock::live {
namespace {

using report::Json;
using ::testing::HasSubstr;
using ::testing::StartsWith;
namespace asio = boost::asio;
namespace beast = boost::beast;
using tcp = asio::ip::tcp;

trial::Scenario Short() {
  return trial::LoadScenario("sea_night_active", {"trial.duration_s=1.5"});
}

struct Message {
  Json head;
  std::string left, right;
};

trial::Series RowsOf(const Message& message) {
  return trial::Series::FromBytes(
      system::BytesOf(message.head.at("rows").at("series").get<std::string>()));
}

// A page without a browser: takes every message and says so.
class Page {
 public:
  explicit Page(const std::string& url) : socket_(io_) {
    const size_t host_begin = std::string("http://").size();
    const size_t path_begin = url.find('/', host_begin);
    const std::string host = url.substr(host_begin, path_begin - host_begin);
    socket_.next_layer().connect(
        {asio::ip::make_address("127.0.0.1"),
         static_cast<uint16_t>(std::stoi(host.substr(host.find(':') + 1)))});
    socket_.handshake(host, url.substr(path_begin) + "live");
  }

  void Say(const Json& command) { socket_.write(asio::buffer(report::JsonLine(command))); }

  Message Next() {
    beast::flat_buffer buffer;
    Read(&buffer);
    const std::string bytes = beast::buffers_to_string(buffer.data());
    size_t size = 0;
    for (size_t i = 0; i < 4; ++i)
      size |= static_cast<size_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
    Message message{.head = Json::parse(bytes.substr(4, size)), .left = {}, .right = {}};
    if (message.head.contains("pictures")) {
      const size_t left = message.head["pictures"]["left"];
      message.left = bytes.substr(4 + size, left);
      message.right = bytes.substr(4 + size + left);
      EXPECT_EQ(message.right.size(), message.head["pictures"]["right"]);
      ++pictures;
    }
    Say({{"do", "got"}, {"n", message.head["n"]}});
    if (message.head.contains("trial")) {
      rows = 0;
      changes = Json::array();
    }
    if (message.head.contains("rows")) {
      const trial::Series news = RowsOf(message);
      EXPECT_EQ(news.columns()[0].name, "frame");
      for (const int64_t frame : std::get<std::vector<int64_t>>(news.columns()[0].values))
        EXPECT_EQ(frame, rows++) << "rows come in order, and every one";
    }
    for (const Json& change : message.head.value("changes", Json::array()))
      changes.push_back(change);
    if (message.head.contains("status")) status = message.head["status"];
    return message;
  }
  // Takes messages until one is as wanted.
  template <class Wanted>
  Message Until(const Wanted& wanted) {
    while (true) {
      Message message = Next();
      if (wanted(message)) return message;
    }
  }

  int64_t rows = 0, pictures = 0;
  Json status, changes = Json::array();

 private:
  // A message that does not come ends the test.
  void Read(beast::flat_buffer* buffer) {
    std::optional<beast::error_code> end;
    socket_.async_read(*buffer, [&](beast::error_code error, size_t) { end = error; });
    io_.restart();
    io_.run_for(std::chrono::minutes(2));
    if (!end) throw std::runtime_error("no message for two minutes");
    if (*end) throw boost::system::system_error(*end);
  }

  asio::io_context io_;
  beast::websocket::stream<tcp::socket> socket_;
};

bool SaysEnd(const Message& message) {
  return message.head.contains("status") && message.head["status"]["ended"] == true;
}

// Serves in a thread of its own until it is destroyed.
class Served {
 public:
  explicit Served(const trial::Scenario& scenario,
                  const LiveSession::OnResult& on_result = nullptr) {
    std::promise<std::string> url;
    std::future<std::string> known = url.get_future();
    thread_ = std::thread([this, scenario, on_result, url = std::move(url)]() mutable {
      ServeTrial(scenario,
                 {.endpoint = {},
                  .on_served = [&](const std::string& address) { url.set_value(address); },
                  .stop_requested = [this] { return stop_.load(); }},
                 on_result);
    });
    url_ = known.get();
  }
  ~Served() { Stop(); }
  void Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  const std::string& url() const { return url_; }

 private:
  std::atomic<bool> stop_ = false;
  std::string url_;
  std::thread thread_;
};

TEST(LiveView, APageSeesAllOfATrialAndDoesNotDisturbIt) {
  Served served(Short());
  Page page(served.url());
  const Message first = page.Until([](const Message& m) { return m.head.contains("trial"); });
  EXPECT_EQ(first.head["trial"]["title"], "night sea, active marker, seed 1");
  EXPECT_TRUE(first.head.contains("controls"));
  const Message shown = page.Until([](const Message& m) { return !m.left.empty(); });
  for (const std::string* picture : {&shown.left, &shown.right}) {
    EXPECT_THAT(*picture, StartsWith("\xff\xd8\xff")) << "JPEG";
    EXPECT_NE(picture->find("\x01\xe0\x02\x80"), std::string::npos) << "480 rows of 640";
  }
  page.Say({{"do", "pause"}});
  page.Until([&](const Message&) { return page.status["going"] == false; });
  const int64_t rows = page.status["frames"];
  for (int i = 0; i < 2; ++i) page.Say({{"do", "step"}});
  page.Until([&](const Message&) { return page.rows == rows + 2; });
  EXPECT_EQ(page.status["going"], false);
  page.Say({{"do", "go"}});
  page.Until(SaysEnd);
  EXPECT_EQ(page.rows, 45);
  EXPECT_GT(page.pictures, 5);
  EXPECT_EQ(page.status["digest"], trial::RunTrial(Short()).digest);
  EXPECT_EQ(page.changes, Json::array());
}

TEST(LiveView, SeveralPagesComeAndGo) {
  Served served(Short());
  Page first(served.url());
  {
    Page other(served.url());
    other.Until([](const Message& m) { return m.head.contains("rows"); });
    other.Say({{"do", "set"}, {"key", "water.milk_ml_m4"}, {"value", 1}});
    const Message answer = other.Until([](const Message& m) { return m.head.contains("problem"); });
    EXPECT_THAT(answer.head["problem"].get<std::string>(), HasSubstr("did you mean"));
    other.Say({{"do", "set"}, {"key", "water.milk_ml_m3"}, {"value", 12}});
    other.Until([](const Message& m) { return m.head.contains("changes"); });
  }  // gone, without a word
  first.Until([&](const Message& m) {
    EXPECT_FALSE(m.head.contains("problem")) << "what another page did wrong is its own";
    return SaysEnd(m);
  });
  EXPECT_EQ(first.changes[0]["value"], "12");
  // one that comes late gets everything
  Page late(served.url());
  late.Until(SaysEnd);
  EXPECT_EQ(late.rows, 45);
  EXPECT_EQ(late.changes, first.changes);
  EXPECT_EQ(late.status["digest"], first.status["digest"]);
  // and begins again, for all
  late.Say({{"do", "restart"}, {"seed", 5}});
  for (Page* page : {&late, &first}) {
    const Message begin = page->Until([](const Message& m) { return m.head.contains("trial"); });
    EXPECT_EQ(begin.head["trial"]["seed"], "5");
    page->Until([](const Message& m) { return m.head.contains("rows"); });
  }
}

TEST(LiveView, APageThatTakesNothingHoldsNobodyUp) {
  Served served(Short());
  Page page(served.url());
  asio::io_context io;
  tcp::socket silent(io);
  const std::string& url = served.url();
  const std::string port = url.substr(url.find(':', 7) + 1);
  silent.connect({asio::ip::make_address("127.0.0.1"), static_cast<uint16_t>(std::stoi(port))});
  const std::string handshake =
      "GET " + url.substr(url.find('/', 8)) +
      "live HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  silent.write_some(asio::buffer(handshake));
  page.Until(SaysEnd);
  EXPECT_EQ(page.rows, 45);
}

TEST(LiveView, WhatWasChangedIsInTheResultOfATrialThatIsCutOff) {
  std::optional<trial::TrialResult> result;
  Served served(Short(), [&](const auto&, const trial::TrialResult& r) { result = r; });
  Page page(served.url());
  const Json clear_m =
      page.Until([](const Message& m) { return m.head.contains("rows"); }).head["sight_m"];
  page.Say({{"do", "set"}, {"key", "water.milk_ml_m3"}, {"value", 120}});
  const auto tells_sight = [](const Message& m) { return m.head.contains("sight_m"); };
  EXPECT_LT(page.Until(tells_sight).head["sight_m"], 0.2 * clear_m.get<double>());
  page.Say({{"do", "push"}, {"force_newton", {0, 1, 0}}});
  page.Until([&](const Message&) { return page.changes.size() == 2; });
  served.Stop();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->outcome, trial::Outcome::kInterrupted);
  EXPECT_EQ(result->changes[1].key, "push");
  EXPECT_EQ(result->changes[1].value, "[0, 1, 0]");
}

// Paused before its first frame: a page that opens then has to have what it is built from.
TEST(LiveView, APageOpenedBeforeTheFirstFrameGetsTheColumns) {
  Served served(Short());
  Page page(served.url());
  page.Until([](const Message& m) { return !m.left.empty(); });
  page.Say({{"do", "pause"}});
  page.Say({{"do", "restart"}});
  page.Until([&](const Message& m) { return m.head.contains("trial"); });
  Page late(served.url());
  const Message first = late.Until([](const Message& m) { return m.head.contains("trial"); });
  const trial::Series rows = RowsOf(first);
  EXPECT_EQ(rows.rows(), 0);
  EXPECT_EQ(rows.names(), trial::Series(trial::TrialLog().thrusters).names());
  EXPECT_EQ(first.head["status"]["frames"], 0);
  EXPECT_TRUE(first.left.empty()) << "a picture of the trial before";
}

}  // namespace
}  // namespace turbidock::live
