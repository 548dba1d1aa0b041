#include "experiments/studies/live/live_board.h"

#include <utility>

#include "experiments/media/jpeg.h"
#include "experiments/page/trial_page.h"
#include "experiments/trial/trial_report.h"

namespace turbidock::live {
namespace {

using report::Json;

constexpr int kJpegQuality = 80;
constexpr int kDigits = 6;
// Messages on the way to a tab: one to be shown while the next travels.
constexpr int64_t kMostUnderWay = 2;
constexpr size_t kMostCommands = 10'000;  // that nobody has looked at

// Takes over what is new at the end of a list that only grows.
template <class T>
void TakeNew(const std::vector<T>& from, std::vector<T>* to) {
  to->insert(to->end(), from.begin() + std::ssize(*to), from.end());
}

// The next elements of a list after those that a tab has had, which are counted.
template <class T>
std::vector<T> TakeNext(const std::vector<T>& list, size_t* had) {
  return {list.begin() + static_cast<ptrdiff_t>(std::exchange(*had, list.size())), list.end()};
}

// A message (live_board.h).
std::string Framed(const Json& head, const std::string& left, const std::string& right) {
  const std::string text = report::JsonLine(head);
  std::string message;
  for (int shift = 0; shift < 32; shift += 8)
    message += static_cast<char>(text.size() >> shift & 0xff);
  return message.append(text).append(left).append(right);
}

Json StatusOf(const LiveSession& session, double real_time_factor) {
  Json status = {{"going", session.going()},
                 {"speed", session.speed()},
                 {"frames", session.log().frames.size()},
                 {"ended", session.result().has_value()},
                 {"real_time_factor", real_time_factor}};
  if (session.result()) {
    status["outcome"] = session.result()->outcome;
    status["reason"] = session.result()->reason;
    status["digest"] = session.result()->digest;
  }
  return status;
}

}  // namespace

// What a tab has had.
class LiveBoard::LiveTab : public serve::Tab {
 public:
  LiveTab(LiveBoard* board, int64_t number) : board_(*board), number_(number) {}
  ~LiveTab() override {
    const std::lock_guard lock(board_.mutex_);
    board_.problems_.erase(number_);
  }

  std::optional<std::string> Next() override {
    Json head = Json::object();
    std::optional<trial::Series> rows;
    trial::ViewCriteria criteria;
    size_t first_row = 0;
    std::shared_ptr<Picture> picture;
    {
      const std::lock_guard lock(board_.mutex_);
      const auto problem = board_.problems_.extract(number_);
      if (!problem.empty()) head["problem"] = problem.mapped();
      if (sent_ - got_ < kMostUnderWay) {
        for (const auto& [name, part] : board_.parts_)
          if (std::exchange(had_[name], part.number) != part.number) head[name] = part.value;
        if (head.contains("trial")) rows_ = transitions_ = changes_ = 0;
        if (transitions_ < board_.transitions_.size())
          head["transitions"] = TakeNext(board_.transitions_, &transitions_);
        if (changes_ < board_.changes_.size())
          head["changes"] = TakeNext(board_.changes_, &changes_);
        // with a trial even if it has none yet: the page is built from its columns
        first_row = std::exchange(rows_, board_.log_.rows());
        if (first_row < rows_ || head.contains("trial")) rows = board_.log_;
        criteria = board_.criteria_;
        if (picture_ != board_.picture_) picture = picture_ = board_.picture_;
      }
    }
    if (rows) head["rows"] = page::TracesModel(*rows, criteria, kDigits, first_row);
    if (head.empty() && !picture) return std::nullopt;
    head["n"] = ++sent_;
    if (!picture) return Framed(head, "", "");
    if (picture->left.empty()) {
      picture->left = media::EncodeJpeg(picture->images.left, kJpegQuality);
      picture->right = media::EncodeJpeg(picture->images.right, kJpegQuality);
    }
    head["pictures"] = {{"frame", picture->frame},
                        {"left", picture->left.size()},
                        {"right", picture->right.size()}};
    return Framed(head, picture->left, picture->right);
  }

  void OnMessage(std::string_view text) override {
    const auto json = Json::parse(text, nullptr, false);
    if (json.is_object() && json.value("do", Json()) == "got") {
      const Json n = json.value("n", Json());
      if (n.is_number_integer() && n > got_ && n <= sent_) got_ = n;
      return;
    }
    const std::lock_guard lock(board_.mutex_);
    if (board_.commands_.size() >= kMostCommands) return;
    board_.commands_.push_back({number_, std::string(text)});
    board_.commanded_.notify_one();
  }

 private:
  LiveBoard& board_;
  int64_t number_;
  int64_t sent_ = 0, got_ = 0;          // messages
  std::map<std::string, int64_t> had_;  // numbers of parts
  size_t rows_ = 0, transitions_ = 0, changes_ = 0;
  std::shared_ptr<Picture> picture_;
};

void LiveBoard::Show(const LiveSession& session, bool whole_images, double real_time_factor) {
  // outside the lock: the trial's model loads a scene
  std::map<std::string, Part> news;
  const bool is_other = session.trial_number() != parts_.at("trial").number;
  if (is_other) news["trial"] = {session.trial_number(), page::TrialModel(session.began())};
  if (const int64_t number = session.settings_number(); number != parts_.at("controls").number) {
    news["controls"] = {number, ControlsModel(session.settings())};
    news["sight_m"] = {number, page::Rounded(trial::Sight_m(session.settings()), 3)};
  }
  news["status"] = {parts_.at("status").number + 1, StatusOf(session, real_time_factor)};
  std::shared_ptr<Picture> picture;
  const auto& frames = session.log().frames;
  if (whole_images && !frames.empty() && !session.latest_images().left.empty())
    picture =
        std::make_shared<Picture>(Picture{frames.back().frame, session.latest_images(), "", ""});

  const std::lock_guard lock(mutex_);
  if (is_other) {
    log_ = trial::Series(session.log().thrusters);
    criteria_ = trial::CriteriaOf(session.began());
    transitions_.clear();
    changes_.clear();
    picture_ = nullptr;
  }
  for (auto& [name, part] : news) parts_[name] = std::move(part);
  for (size_t i = log_.rows(); i < frames.size(); ++i) log_.Add(frames[i]);
  TakeNew(session.transitions(), &transitions_);
  TakeNew(session.changes(), &changes_);
  if (picture) picture_ = picture;
}

std::vector<LiveBoard::Command> LiveBoard::Commands(Clock::time_point until) {
  std::unique_lock lock(mutex_);
  commanded_.wait_until(lock, until, [this] { return !commands_.empty(); });
  return std::exchange(commands_, {});
}

void LiveBoard::Complain(int64_t tab, const std::string& problem) {
  const std::lock_guard lock(mutex_);
  problems_[tab] = problem;
}

std::unique_ptr<serve::Tab> LiveBoard::OpenTab() {
  const std::lock_guard lock(mutex_);
  return std::make_unique<LiveTab>(this, ++last_tab_);
}

}  // namespace turbidock::live
