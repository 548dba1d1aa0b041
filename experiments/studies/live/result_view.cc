#include "experiments/studies/live/result_view.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace turbidock::live {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPoll(50);
constexpr std::chrono::seconds kLeastRest(2);
constexpr int kRest = 10;  // in times that it took to make the page

class FreshPage {
 public:
  explicit FreshPage(std::function<page::Page()> make) : make_(std::move(make)) {}

  const std::string& Html() {
    const Clock::time_point begin = Clock::now();
    if (html_.empty() || begin >= due_) {
      html_ = page::Html(make_());
      const Clock::time_point end = Clock::now();
      due_ = end + std::max<Clock::duration>(kLeastRest, kRest * (end - begin));
    }
    return html_;
  }

 private:
  std::function<page::Page()> make_;
  std::string html_;
  Clock::time_point due_;
};

}  // namespace

void ServeResult(const std::function<page::Page()>& make_page, const ServeOptions& options) {
  FreshPage page(make_page);
  page.Html();  // what is wrong with it is said now; from here on only the server asks for it
  const serve::Server server(options.place, {.page = [&] { return page.Html(); }, .open_tab = {}});
  options.on_served(server.url());
  while (!options.stop_requested()) std::this_thread::sleep_for(kPoll);
}

}  // namespace turbidock::live
