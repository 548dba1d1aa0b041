#pragma once
// A small HTTP server for one page and the sockets of its tabs: what `turbidock view` is served
// with. It gives out nothing else, knows no files and reads no bodies.
//
//   GET /SECRET/       the page
//   GET /SECRET/live   a WebSocket, where there are any
//
// Anything else is refused: another path or method (404, 405), a body (413), a foreign Host or
// Origin (403), a request that takes too long. Of more requests or tabs than there is room for the
// oldest unfinished one or the one silent longest is closed.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace turbidock::serve {

// The other end of a tab's WebSocket. Like Site, called in the server's thread only.
class Tab {
 public:
  virtual ~Tab() = default;
  // The next message for it, asked for when it has taken the one before; nothing: nothing new until
  // Server::Wake or the tab's next message.
  virtual std::optional<std::string> Next() = 0;
  virtual void OnMessage(std::string_view text) = 0;
};

struct Site {
  // The page as it is now: HTML, with everything in it. An exception shows as text.
  std::function<std::string()> page;
  std::function<std::unique_ptr<Tab>()> open_tab;  // none: no sockets
};

struct Endpoint {
  std::string address = "127.0.0.1";
  int port = 0;  // 0: any that is free
};

class Server {
 public:
  static constexpr size_t kMostRequests = 48, kMostTabs = 16;  // at once
  static constexpr int kMostMessageBytes = 64 * 1024;          // that a tab may send

  // Listens and serves in a thread of its own from here on. ConfigError when it cannot listen
  // there: no such address, a port that is in use.
  Server(const Endpoint& endpoint, Site site);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Where to find the page, with the secret.
  const std::string& url() const { return url_; }
  int tabs() const;  // that are open

  // There is something new for the tabs. From any thread; cheap.
  void Wake();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
  std::string url_;
};

}  // namespace turbidock::serve
