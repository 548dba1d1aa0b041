#include "experiments/studies/live/results_view.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/farm/run_lock.h"
#include "experiments/farm/trial_scheduler.h"
#include "experiments/statistics/intervals.h"
#include "experiments/studies/live/message.h"

namespace turbidock::live {
namespace {

using report::Json;
using std::chrono::milliseconds;

constexpr milliseconds kPoll(50);
constexpr int kPollsBetweenLooks = 20;
constexpr double kLeastForASpeed_s = 3;

double Now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// What is known now, for tabs that come and go.
class Notice {
 public:
  // Whether it is another than the last one.
  bool Put(Json news) {
    const std::lock_guard lock(mutex_);
    if (news == news_) return false;
    news_ = std::move(news);
    ++number_;
    return true;
  }
  std::optional<Json> After(int64_t* number) const {
    const std::lock_guard lock(mutex_);
    if (*number == number_) return std::nullopt;
    *number = number_;
    return news_;
  }

 private:
  mutable std::mutex mutex_;
  Json news_;
  int64_t number_ = 0;
};

class NoticeTab : public serve::Tab {
 public:
  explicit NoticeTab(const Notice* notice) : notice_(*notice) {}
  std::optional<std::string> Next() override {
    const std::optional<Json> news = notice_.After(&number_);
    if (!news) return std::nullopt;
    return Framed({{"n", number_}, {"progress", *news}});
  }
  void Hear(std::string_view) override {}

 private:
  const Notice& notice_;
  int64_t number_ = 0;
};

}  // namespace

Json ResultsProgress::Look(const std::string& file, double now_s) {
  const farm::ResultStore store = farm::ResultStore::Read(file);
  const std::vector<farm::Verdict> verdicts = store.Verdicts();
  const int64_t done = std::ssize(verdicts);
  const int64_t successes = std::ranges::count(verdicts, true, &farm::Verdict::success);
  if (first_done_ < 0) {
    first_done_ = done;
    first_s_ = now_s;
  }
  const statistics::Interval wilson = statistics::WilsonInterval(successes, done);
  Json progress = {{"running", farm::IsLocked(file)},
                   {"done", done},
                   {"successes", successes},
                   {"wilson", wilson},
                   {"by_hour", nullptr},
                   {"wanted", nullptr},
                   {"expected", nullptr}};
  // a tuning study knows its number of trials only when it is over
  if (store.header().trials > 0) {
    const farm::TrialScheduler scheduler = farm::SchedulerOf(store);
    progress["wanted"] = scheduler.wanted();
    progress["expected"] = scheduler.Expected();
  }
  if (const double passed_s = now_s - first_s_; passed_s > kLeastForASpeed_s && done > first_done_)
    progress["by_hour"] = 3600 * static_cast<double>(done - first_done_) / passed_s;
  return progress;
}

void ServePage(const page::Page& page, const ResultsOptions& options) {
  const serve::Server server(options.place,
                             {.page = [html = page::Html(page)] { return html; }, .open_tab = {}});
  options.on_served(server.url());
  while (!options.stop_requested()) std::this_thread::sleep_for(kPoll);
}

void ServeResults(const std::string& file, const std::function<page::Page()>& make_page,
                  const ResultsOptions& options) {
  const auto html = [make_page] {
    page::Page page = make_page();
    page.model["shows"] = page.model["kind"];
    page.model["kind"] = "progress";
    return page::Html(page);
  };
  html();  // what is wrong with it is said now
  ResultsProgress progress;
  Notice notice;
  notice.Put(progress.Look(file, Now_s()));
  serve::Server server(options.place, {.page = html, .open_tab = [&notice] {
                                         return std::make_unique<NoticeTab>(&notice);
                                       }});
  options.on_served(server.url());
  for (int polls = 1; !options.stop_requested(); ++polls) {
    std::this_thread::sleep_for(kPoll);
    if (polls % kPollsBetweenLooks != 0 || server.tabs() == 0) continue;
    try {
      if (notice.Put(progress.Look(file, Now_s()))) server.Wake();
    } catch (const ConfigError& error) {
      if (notice.Put({{"problem", error.what()}})) server.Wake();
    }
  }
}

}  // namespace turbidock::live
