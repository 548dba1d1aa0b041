#include "experiments/studies/live/live_view.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "experiments/studies/live/live_board.h"

namespace turbidock::live {
namespace {

using std::chrono::duration_cast;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr auto kPoll = 50ms;  // at most between two looks at signals and the first tab
constexpr auto kPictureEvery = 20ms;
constexpr auto kMostLate = 100ms;  // what is later than this is not caught up with
constexpr auto kLeastRest = 2s;    // of a result's page
constexpr int kRest = 10;          // in times that it took to make it

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

void ServeTrial(const trial::Scenario& scenario, const ServeOptions& options,
                const LiveSession::OnResult& on_result) {
  LiveSession session(scenario, on_result);
  LiveBoard board;
  board.Show(session, false, 0);
  const std::string html =
      page::Html({.model = {{"kind", "live"}, {"title", scenario.description}}, .has_3d = true});
  serve::Server server(options.endpoint,
                       {.page = [&] { return html; }, .open_tab = [&] { return board.OpenTab(); }});
  options.on_served(server.url());

  const Seconds frame(scenario.clock.frame_s());
  Clock::time_point next_picture = Clock::now(), due = next_picture, begin = due;
  Seconds simulated{};  // since `begin`
  double real_time_factor = 0;
  bool was_watched = false, goes_on = false;
  while (!options.stop_requested()) {
    const auto poll = Clock::now() + kPoll;
    const bool were_asked = HandleCommands(goes_on ? std::min(due, poll) : poll, &board, &session);
    was_watched = was_watched || server.tabs() > 0;
    const auto now = Clock::now();
    if (const bool went_on = goes_on; (goes_on = was_watched && session.wants_step()) && !went_on) {
      due = begin = now;
      simulated = Seconds{};
    }
    const bool is_due = goes_on && now >= due;
    const bool whole_images = is_due && (now >= next_picture || !session.going());
    if (whole_images) next_picture = now + kPictureEvery;
    if (is_due) {
      session.Step(whole_images);
      const auto then = Clock::now();
      due =
          std::max(due + duration_cast<Clock::duration>(frame / session.speed()), then - kMostLate);
      simulated += frame;
      if (then - begin >= Seconds(1)) {
        real_time_factor = simulated / (then - begin);
        begin = then;
        simulated = Seconds{};
      }
    }
    if (!is_due && !were_asked) continue;
    board.Show(session, whole_images, real_time_factor);
    server.Wake();
  }
  session.Close();
}

void ServeResult(const std::function<page::Page()>& make_page, const ServeOptions& options) {
  std::string html;
  Clock::time_point due = Clock::now();
  const auto fresh_html = [&] {
    const auto begin = Clock::now();
    if (begin < due) return html;
    html = page::Html(make_page());
    const auto end = Clock::now();
    due = end + std::max<Clock::duration>(kLeastRest, kRest * (end - begin));
    return html;
  };
  fresh_html();  // what is wrong with it is said now; from here on only the server asks for it
  const serve::Server server(options.endpoint, {.page = fresh_html, .open_tab = {}});
  options.on_served(server.url());
  while (!options.stop_requested()) std::this_thread::sleep_for(kPoll);
}

}  // namespace turbidock::live
