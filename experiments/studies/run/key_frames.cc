#include "experiments/studies/run/key_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "experiments/media/canvas.h"
#include "experiments/media/jpeg.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::run {
namespace {

namespace fs = std::filesystem;

constexpr double kFirstStep_s = 0.5;
constexpr size_t kMost = 80;  // pictures; then every second one goes
constexpr int kLargestWidth_px = 320;
constexpr int kQuality = 70;

std::string Encoded(const Image3u8& image) {
  const int width = std::min(image.width(), kLargestWidth_px);
  media::Canvas small(width, std::max(1, width * image.height() / image.width()));
  small.DrawImage(image, small.area());
  return media::EncodeJpeg(small.ToImage(), kQuality);
}

}  // namespace

KeyFrames::KeyFrames(std::string folder, int frames_per_second)
    : folder_(std::move(folder)),
      first_step_(std::max(1, static_cast<int>(kFirstStep_s * frames_per_second))),
      step_(first_step_) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw ConfigError(folder_ + ": cannot be made: " + error.message());
}

void KeyFrames::Add(int64_t frame, const StereoImage& images) {
  if (frame % step_ != 0) return;
  pictures_.push_back({frame, images.Each([](const Image3u8& image) { return Encoded(image); })});
  if (pictures_.size() < kMost) return;
  step_ *= 2;
  std::erase_if(pictures_, [this](const Pictures& p) { return p.frame % step_ != 0; });
}

void KeyFrames::Write() const {
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with("_left.jpg") || name.ends_with("_right.jpg")) old.push_back(entry.path());
  }
  for (const fs::path& path : old) fs::remove(path);
  for (const Pictures& p : pictures_) {
    const std::string number = fmt::format("{}/{:06}", folder_, p.frame);
    system::WriteWhole(number + "_left.jpg", p.jpeg.left);
    system::WriteWhole(number + "_right.jpg", p.jpeg.right);
  }
}

}  // namespace turbidock::run
