#include "experiments/studies/live/live_board.h"

#include <algorithm>
#include <utility>

#include "experiments/media/jpeg.h"
#include "experiments/page/trial_model.h"
#include "experiments/trial/series.h"

namespace turbidock::live {
namespace {

using report::Json;

// Messages on the way to a tab: one to be shown while the next travels.
constexpr int64_t kMostUnderWay = 2;
constexpr size_t kMostRows = 2000;        // in a message
constexpr size_t kMostCommands = 10'000;  // that nobody has looked at

// Takes over what is new at the end of a list that only grows.
template <class T>
void TakeNew(const std::vector<T>& from, std::vector<T>* to) {
  to->insert(to->end(), from.begin() + std::ssize(*to), from.end());
}

template <class T>
std::vector<T> Part(const std::vector<T>& list, size_t begin, size_t most) {
  const size_t end = std::min(list.size(), begin + most);
  return {list.begin() + static_cast<ptrdiff_t>(begin), list.begin() + static_cast<ptrdiff_t>(end)};
}

// A message (live_board.h).
std::string Framed(const report::Json& head, const std::string& left = "",
                   const std::string& right = "") {
  const std::string text = report::JsonLine(head);
  std::string message;
  message.reserve(4 + text.size() + left.size() + right.size());
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

  std::optional<std::string> Next() override;
  void Hear(std::string_view text) override;

 private:
  LiveBoard& board_;
  int64_t number_;
  int64_t sent_ = 0, got_ = 0;  // messages
  int64_t trial_number_ = 0, settings_number_ = 0, status_number_ = 0;
  size_t rows_ = 0, transitions_ = 0, changes_ = 0;
  std::shared_ptr<const Picture> picture_;
};

std::optional<std::string> LiveBoard::LiveTab::Next() {
  Json head = Json::object();
  trial::TrialLog rows;
  std::shared_ptr<const Picture> picture;
  {
    const std::lock_guard lock(board_.mutex_);
    const auto problem = board_.problems_.extract(number_);
    if (!problem.empty()) head["problem"] = problem.mapped();
    const bool is_late = sent_ - got_ >= kMostUnderWay;
    if (is_late && problem.empty()) return std::nullopt;
    if (!is_late) {
      if (trial_number_ != board_.trial_number_) {
        trial_number_ = board_.trial_number_;
        head["trial"] = board_.trial_;
        rows_ = transitions_ = changes_ = 0;
      }
      if (settings_number_ != board_.settings_number_) {
        settings_number_ = board_.settings_number_;
        head["controls"] = board_.controls_;
      }
      if (status_number_ != board_.status_number_) {
        status_number_ = board_.status_number_;
        head["status"] = board_.status_;
      }
      rows.thrusters = board_.thrusters_;
      rows.frames = Part(board_.rows_, rows_, kMostRows);
      if (transitions_ < board_.transitions_.size())
        head["transitions"] = Part(board_.transitions_, transitions_, kMostRows);
      if (changes_ < board_.changes_.size())
        head["changes"] = Part(board_.changes_, changes_, kMostRows);
      if (picture_ != board_.picture_) picture = picture_ = board_.picture_;
    }
  }
  if (!rows.frames.empty()) {
    head["rows"] = page::SeriesModel(trial::Series::Of(rows));
    rows_ += rows.frames.size();
  }
  if (head.contains("transitions")) transitions_ += head["transitions"].size();
  if (head.contains("changes")) changes_ += head["changes"].size();
  if (head.empty() && !picture) return std::nullopt;
  head["n"] = ++sent_;
  if (!picture) return Framed(head);
  const EncodedPicture& encoded = board_.Encode(picture);
  head["pictures"] = {
      {"frame", picture->frame}, {"left", encoded.left.size()}, {"right", encoded.right.size()}};
  return Framed(head, encoded.left, encoded.right);
}

void LiveBoard::LiveTab::Hear(std::string_view text) {
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

void LiveBoard::Show(const LiveSession& session, bool whole_images, double real_time_factor) {
  // outside the lock: the trial's model loads a scene
  const bool is_other = session.trial_number() != trial_number_;
  const bool are_other_settings = session.settings_number() != settings_number_;
  Json trial, controls;
  if (are_other_settings) controls = ControlsModel(session.settings());
  if (is_other) trial = page::TrialModel(session.began());
  std::shared_ptr<const Picture> picture;
  const auto& frames = session.log().frames;
  if (whole_images && !frames.empty() && !session.seen().left.empty())
    picture = std::make_shared<const Picture>(Picture{frames.back().frame, session.seen()});

  const std::lock_guard lock(mutex_);
  if (is_other) {
    trial_number_ = session.trial_number();
    trial_ = std::move(trial);
    thrusters_ = session.log().thrusters;
    rows_.clear();
    transitions_.clear();
    changes_.clear();
  }
  if (are_other_settings) {
    settings_number_ = session.settings_number();
    controls_ = std::move(controls);
  }
  TakeNew(frames, &rows_);
  TakeNew(session.transitions(), &transitions_);
  TakeNew(session.changes(), &changes_);
  status_ = StatusOf(session, real_time_factor);
  ++status_number_;
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

const LiveBoard::EncodedPicture& LiveBoard::Encode(const std::shared_ptr<const Picture>& picture) {
  if (encoded_.of == picture) return encoded_;
  const Clock::time_point begin = Clock::now();
  encoded_ = {picture, media::EncodeJpeg(picture->images.left, jpeg_quality_),
              media::EncodeJpeg(picture->images.right, jpeg_quality_)};
  const std::lock_guard lock(mutex_);
  ++cost_.pictures;
  cost_.encode_s += std::chrono::duration<double>(Clock::now() - begin).count();
  cost_.bytes += static_cast<int64_t>(encoded_.left.size() + encoded_.right.size());
  return encoded_;
}

ShowCost LiveBoard::cost() const {
  const std::lock_guard lock(mutex_);
  return cost_;
}

}  // namespace turbidock::live
