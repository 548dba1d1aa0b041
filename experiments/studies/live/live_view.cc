#include "experiments/studies/live/live_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "experiments/page/page.h"
#include "experiments/studies/live/live_session.h"
#include "experiments/trial/trial_files.h"

namespace turbidock::live {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration_cast;

Clock::duration Seconds(double s) {
  return duration_cast<Clock::duration>(std::chrono::duration<double>(s));
}

double SecondsOf(Clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

constexpr double kPoll_s = 0.05;  // at most between two looks at signals and the first tab
constexpr double kPictureEvery_s = 0.02, kUnwatchedPictureEvery_s = 1;
constexpr double kMostLate_s = 0.1;  // what is later than this is not caught up with

// When frames are due.
class Pace {
 public:
  explicit Pace(double frame_s) : frame_s_(frame_s) {}

  Clock::time_point due() const { return due_; }
  void Stepped(Clock::time_point now, double speed) {
    due_ = std::max(due_ + Seconds(frame_s_ / speed), now - Seconds(kMostLate_s));
  }
  // After a pause: from here on.
  void Begin(Clock::time_point now) { due_ = now; }

 private:
  double frame_s_;
  Clock::time_point due_ = Clock::now();
};

// Simulated over wall time, of the last second or so.
class Speedometer {
 public:
  void Begin(Clock::time_point now) {
    begin_ = now;
    simulated_s_ = 0;
  }
  void Stepped(Clock::time_point now, double frame_s) {
    simulated_s_ += frame_s;
    const double passed_s = SecondsOf(now - begin_);
    if (passed_s < 1) return;
    factor_ = simulated_s_ / passed_s;
    Begin(now);
  }
  double factor() const { return factor_; }

 private:
  Clock::time_point begin_ = Clock::now();
  double simulated_s_ = 0, factor_ = 0;
};

std::string PageOf(const trial::Scenario& scenario) {
  return page::Html({.model = {{"kind", "live"}, {"title", scenario.description}}, .has_3d = true});
}

// What is said of a trial that has ended.
std::string EndText(const trial::Scenario& began, const trial::TrialResult& result) {
  const size_t changes = result.changes.size();
  return fmt::format("seed {}: {}: {}, digest {}{}", began.seed, NameOf(result.outcome),
                     result.reason, result.digest,
                     changes == 0 ? "" : fmt::format(", {} settings changed on the way", changes));
}

// Does what the tabs ask for until then. Returns whether they asked for anything.
bool HandleCommands(Clock::time_point until, LiveBoard* board, LiveSession* session) {
  const std::vector<LiveBoard::Command> commands = board->Commands(until);
  for (const auto& [tab, text] : commands) {
    try {
      session->Handle(text);
    } catch (const ConfigError& error) {
      board->Complain(tab, error.what());
    }
  }
  return !commands.empty();
}

}  // namespace

ViewSummary ServeTrial(const trial::Scenario& scenario, const ViewOptions& options) {
  LiveSession session(scenario,
                      [&](const trial::Scenario& began, const trial::TrialResult& result) {
                        options.say(EndText(began, result));
                        if (options.out) trial::WriteRecords(*options.out, began, result);
                      });
  LiveBoard board(options.jpeg_quality);
  board.Show(session, false, 0);
  serve::Server server(options.place, {.page = [page = PageOf(scenario)] { return page; },
                                       .open_tab = [&] { return board.OpenTab(); }});
  options.on_served(server.url());

  ViewSummary summary;
  const double frame_s = scenario.clock.frame_s();
  Pace pace(frame_s);
  Speedometer speed;
  Clock::time_point next_picture = Clock::now();
  bool was_watched = false, stepped = false;
  while (!options.stop_requested()) {
    const auto poll = Clock::now() + Seconds(kPoll_s);
    const bool steps = was_watched && session.wants_step();
    const bool were_asked =
        HandleCommands(steps ? std::min(pace.due(), poll) : poll, &board, &session);
    was_watched = was_watched || server.tabs() > 0;
    const auto now = Clock::now();
    bool whole_images = false;
    if (const bool goes_on = was_watched && session.wants_step(); !goes_on) {
      stepped = false;
      if (!were_asked) continue;
    } else {
      if (!stepped) {
        pace.Begin(now);
        speed.Begin(now);
        stepped = true;
      }
      const bool is_due = now >= pace.due();
      if (!is_due && !were_asked) continue;
      if (is_due) {
        whole_images = now >= next_picture || !session.going();
        if (whole_images)
          next_picture =
              now + Seconds(server.tabs() > 0 ? kPictureEvery_s : kUnwatchedPictureEvery_s);
        session.Step(whole_images);
        const auto after = Clock::now();
        summary.step_s += SecondsOf(after - now);
        ++summary.frames;
        pace.Stepped(after, session.speed());
        speed.Stepped(after, frame_s);
      }
    }
    board.Show(session, whole_images, speed.factor());
    server.Wake();
  }
  session.Close();
  summary.shown = board.cost();
  return summary;
}

}  // namespace turbidock::live
