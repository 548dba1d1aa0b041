// The page of a result over real sockets, while the result grows.

#include "experiments/studies/live/live_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <future>
#include <string>
#include <thread>

#include "sim/base/check.h"

namespace turbidock::live {
namespace {

using ::testing::HasSubstr;
namespace asio = boost::asio;
namespace http = boost::beast::http;
using http::status;
using tcp = asio::ip::tcp;

http::response<http::string_body> Get(const std::string& url) {
  const size_t host_begin = std::string("http://").size(), path_begin = url.find('/', host_begin);
  const std::string host = url.substr(host_begin, path_begin - host_begin);
  asio::io_context io;
  tcp::socket socket(io);
  socket.connect({asio::ip::make_address("127.0.0.1"),
                  static_cast<uint16_t>(std::stoi(host.substr(host.find(':') + 1)))});
  http::request<http::empty_body> request(http::verb::get, url.substr(path_begin), 11);
  request.set(http::field::host, host);
  http::write(socket, request);
  boost::beast::flat_buffer buffer;
  http::response<http::string_body> response;
  http::read(socket, buffer, response);
  return response;
}

TEST(ServeResult, MakesThePageAnewAndSaysWhyItCannot) {
  std::atomic<int> made = 0;
  std::atomic<bool> stop = false, is_gone = false;
  std::promise<std::string> url;
  std::thread server([&] {
    ServeResult(
        [&] {
          if (is_gone) throw ConfigError("sweep.db: no such file");
          return page::Page{.model = {{"kind", "batch"}, {"title", std::to_string(++made)}}};
        },
        {.endpoint = {},
         .on_served = [&](const std::string& address) { url.set_value(address); },
         .stop_requested = [&] { return stop.load(); }});
  });
  const std::string address = url.get_future().get();
  EXPECT_THAT(Get(address).body(), HasSubstr("<title>1</title>"));
  EXPECT_THAT(Get(address).body(), HasSubstr("<title>1</title>")) << "it rests in between";
  std::this_thread::sleep_for(std::chrono::milliseconds(2200));
  EXPECT_THAT(Get(address).body(), HasSubstr("<title>2</title>"));
  EXPECT_EQ(made, 2);
  is_gone = true;
  std::this_thread::sleep_for(std::chrono::milliseconds(2200));
  const auto refusal = Get(address);
  EXPECT_EQ(refusal.result(), status::internal_server_error);
  EXPECT_EQ(refusal.body(), "sweep.db: no such file\n");
  stop = true;
  server.join();
}

TEST(ServeResult, EndsWhereThereIsNothingToServe) {
  const ServeOptions options{.endpoint = {},
                             .on_served = [](const std::string&) { FAIL() << "nothing is served"; },
                             .stop_requested = [] { return false; }};
  const auto make = []() -> page::Page { throw ConfigError("nowhere.db: no such file"); };
  EXPECT_THROW(ServeResult(make, options), ConfigError);
}

}  // namespace
}  // namespace turbidock::live
