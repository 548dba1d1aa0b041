#pragma once
// Between the thread that simulates and the one that serves: what the tabs are shown and what they
// ask for.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/serve/server.h"
#include "experiments/studies/live/live_session.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_record.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/image.h"

namespace turbidock::live {

// Messages to a tab: the length of the head (4 bytes, least significant first), the head, which is
// JSON, then the left and the right picture (JPEG). The head has, where there is something new,
//   n            number of the message, to be given back as {"do": "got", "n": ...}
//   trial        another trial: what the page knows of one before it runs
//   controls     what can be set, with values
//   sight_m      how far one can see in the water as it is set, or null
//   status       going, speed, frame, ended and so on
//   rows         traces of a trial (page/trial_page.h): the rows since the last message
//   transitions, changes   those since the last message
//   pictures     {frame, left, right}: the frame they belong to, and their sizes in bytes
//   problem      a sentence about this tab's last command
// A tab that is slow to answer gets fewer pictures, but every row.
class LiveBoard {
 public:
  using Clock = std::chrono::steady_clock;

  // In the thread that simulates: the session as it is now; `whole_images`: its images are whole.
  void Show(const LiveSession& session, bool whole_images, double real_time_factor);

  struct Command {
    int64_t tab = 0;
    std::string text;
  };
  // What the tabs asked for since the last call; waits for it until then.
  std::vector<Command> Commands(Clock::time_point until);
  void Complain(int64_t tab, const std::string& problem);

  // In the thread that serves.
  std::unique_ptr<serve::Tab> OpenTab();

 private:
  class LiveTab;
  struct Part {
    int64_t number = 0;  // counts its changes
    report::Json value;
  };
  struct Picture {
    int64_t frame = 0;
    StereoImage images;
    std::string left, right;  // encoded by the serving thread, once for all tabs
  };

  std::mutex mutex_;
  std::condition_variable commanded_;
  std::vector<Command> commands_;
  std::map<int64_t, std::string> problems_;  // by tab
  int64_t last_tab_ = 0;
  // what the session showed last
  std::map<std::string, Part> parts_ = {
      {"trial", {}}, {"controls", {}}, {"sight_m", {}}, {"status", {}}};
  trial::Series log_;
  trial::ViewCriteria criteria_;
  std::vector<control::Transition> transitions_;
  std::vector<trial::Change> changes_;
  std::shared_ptr<Picture> picture_;
};

}  // namespace turbidock::live
